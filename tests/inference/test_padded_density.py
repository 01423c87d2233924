"""Padding counts for nothing: densities and gradients are those of the bare rows."""

import dataclasses

import jax
import numpy as np
import pytest
from moving import moving_case
from rigs import draw_truth, make_case, make_gear, program
from slices import slice_of
from structures import form_of

from hdcal.data.priors import effect_priors
from hdcal.inference import compression, likelihood
from hdcal.inference.identifiability import linearise
from hdcal.inference.marginal import draw_members
from hdcal.inference.padding import bucket_size
from hdcal.inference.problem import build_problem, without_scatter
from hdcal.inference.serial_correlation import previous_rows
from hdcal.inference.values import predict_rows
from hdcal.motion.dynamic_problem import (
    build_dynamic,
    dynamic_site_priors,
    predict_motion,
)
from hdcal.physics.registry import EFFECTS

# Sums over more rows are added up in another order.
CLOSE = {"rtol": 1e-11, "atol": 1e-12}
EXPAND = jax.jit(jax.value_and_grad(likelihood.log_likelihood, argnums=1))
DRAW = jax.jit(draw_members)
MOVE = jax.jit(predict_motion)
STAGES = ("deformation", "force", "sensor", "noise")


def case_of(*, runs=1, specimens=1, sds=(0.0,), resolution=0.0):
    """Return rows of three cycles, whose runs and specimens take turns."""
    records = program()
    rows = len(records.force)
    assert bucket_size(rows) > rows
    rng = np.random.default_rng(4)
    known = {"angle", "bare_rig"} | ({"run"} if runs > 1 else set())
    known |= {"specimen"} if specimens > 1 else set()
    force = 200.0 * records.deformation + rng.normal(0.0, 0.6, rows)
    records = dataclasses.replace(
        records,
        angle=2.4 * np.arange(rows),
        force=force if resolution == 0.0 else resolution * np.round(force / resolution),
        run=np.arange(rows) * 7 % runs,
        specimen=np.arange(rows) * 5 % specimens,
        force_sd=rng.choice(sds, rows),
        known=records.known | known,
    )
    return make_case(records, make_gear(resolution=resolution))


def values_of(problem, seed=0) -> dict:
    """Return parameters and members, all of them away from their nulls."""
    values = draw_truth(problem, jax.random.key(seed))
    values |= {"sigma": np.float64(0.7), "noise_correlation": np.float64(0.5)}
    rng, gap = np.random.default_rng(seed), problem.discrepancy
    members = {
        "run_offset": rng.normal(0.0, 1.0, problem.runs),
        "specimen_deviation": rng.normal(0.0, 0.02, problem.specimens),
        "gap_weights": rng.normal(0.0, 0.3, gap.size if gap else 0),
    }
    return values | {name: size for name, size in members.items() if len(size)}


def moves(case):
    """Return where the readings were taken and which way, for a leftover."""
    return case.records.deformation, case.records.sense


def bare(problem, case):
    """Return the same problem with its rows as they were measured."""
    columns = None
    if problem.discrepancy is not None:
        columns = np.asarray(problem.discrepancy.columns(*moves(case)))
    before = previous_rows(case.records) if problem.correlated else None
    return dataclasses.replace(
        problem, records=case.records, columns=columns, blocks=None, before=before
    )


def of_stage(stage):
    return without_scatter([e for e in EFFECTS.values() if e.stage == stage])


PROBLEMS = {
    **{f"every effect of the {stage}": (of_stage(stage), {}) for stage in STAGES},
    "rounded, runs and discrepancy": (
        (),
        {"resolution": 1.0, "runs": 4, "specimens": 3, "with_gap": True},
    ),
    "runs integrated out": (
        of_stage("sensor"),
        {"runs": 4, "specimens": 3, "sds": (0.1, 0.5), "with_gap": True},
    ),
}


QUICK = ("every effect of the force", "rounded, runs and discrepancy")


@pytest.mark.parametrize("name", slice_of(PROBLEMS, QUICK))
def test_padded_rows_have_the_density_of_the_measured_ones(name: str):
    effects, data = PROBLEMS[name]
    with_gap = data.get("with_gap", False)
    case = case_of(**{k: v for k, v in data.items() if k != "with_gap"})
    problem = build_problem(
        case, effect_priors(), effects, structure=form_of(case, effects, with_gap)
    )
    rows = len(case.records.force)
    assert len(problem.rows.force) == bucket_size(rows)
    assert problem.count == rows
    values = values_of(problem)
    found, slow = (EXPAND(p, values) for p in (problem, bare(problem, case)))
    np.testing.assert_allclose(float(found[0]), float(slow[0]), **CLOSE)
    # Terms as large as the density cancel in a small slope: to their rounding.
    rounding = 4.0 * np.finfo(float).eps * abs(float(slow[0]))
    close = CLOSE | {"atol": CLOSE["atol"] + rounding}
    for site, slope in slow[1].items():
        np.testing.assert_allclose(found[1][site], slope, **close, err_msg=site)
    assert np.isfinite(float(found[0]))
    if problem.integrated:
        key = jax.random.key(1)
        drawn, alone = (
            DRAW(problem, values, key),
            DRAW(bare(problem, case), values, key),
        )
        for site, draw in alone.items():
            np.testing.assert_allclose(drawn[site], draw, rtol=1e-8, atol=1e-11)


def test_a_row_of_padding_that_counts_is_seen():
    """The same comparison, had one padded row been taken for a measured one."""
    case = case_of()
    problem = build_problem(case, effect_priors(), of_stage("sensor"))
    more = dataclasses.replace(problem, count=problem.count + 1)
    values = values_of(problem)
    found, slow = (float(EXPAND(p, values)[0]) for p in (more, bare(problem, case)))
    assert abs(found - slow) > 1e-6 * abs(slow)


def test_groups_of_no_rows_change_nothing():
    """A stated sd of each row makes a group of each: their number is padded too."""
    rng = np.random.default_rng(0)
    case = case_of(runs=3)
    sds = rng.uniform(0.1, 0.9, len(case.records.force))
    records = dataclasses.replace(
        case.records, force_sd=sds, known=case.records.known | {"force_sd"}
    )
    case = dataclasses.replace(case, records=records)
    problem = build_problem(case, effect_priors())
    blocks = problem.blocks
    assert blocks is not None
    groups = len(np.unique(np.stack([sds, records.run]), axis=1).T)
    assert len(blocks.count) == bucket_size(groups) > groups
    cut = jax.tree.map(lambda part: part[:groups], blocks)
    assert (blocks.count[groups:] == 0.0).all()
    values = values_of(problem)
    slow = EXPAND(dataclasses.replace(problem, blocks=cut), values)
    found = EXPAND(problem, values)
    np.testing.assert_allclose(float(found[0]), float(slow[0]), **CLOSE)
    for site, slope in slow[1].items():
        scale = np.abs(np.asarray(slope)).max()
        np.testing.assert_allclose(found[1][site], slope, rtol=0, atol=1e-11 * scale)
    # And without the runs integrated out.
    single = dataclasses.replace(problem, integrated=())
    ends = [
        float(EXPAND(dataclasses.replace(single, blocks=part), values)[0])
        for part in (blocks, cut)
    ]
    np.testing.assert_allclose(*ends, **CLOSE)


def test_groups_of_one_sd_are_not_padded():
    """Runs and specimens have parameters: another number is another executable."""
    problem = build_problem(case_of(runs=3, specimens=2), effect_priors())
    assert isinstance(problem.blocks, compression.CompressedRows)
    assert len(problem.blocks.count) == 6


def test_derivatives_of_measured_rows_are_those_without_padding():
    case = case_of(runs=3, specimens=2)
    effects = of_stage("force")
    problem = build_problem(
        case, effect_priors(), effects, structure=form_of(case, effects, True)
    )
    values = values_of(problem)
    columns = np.asarray(problem.discrepancy.columns(*moves(case)))
    found = linearise(problem, values, case.records)

    @jax.jit
    def expand(part):
        """Return slopes, what a stiffer gear gains, and the sd of the noise."""

        def mean(moved):
            everything = values | moved
            return predict_rows(problem, everything, case.records, columns)[0]

        _, noise = predict_rows(problem, values, case.records, columns)
        stiffer = {"K": values["K"]}
        gain = jax.jvp(mean, (stiffer,), (stiffer,))[1]
        return jax.jacfwd(mean)(part), gain, noise.sd[0]

    slow, gain, sd = expand({name: values[name] for name in found.slopes})
    np.testing.assert_allclose(found.sd, sd, rtol=1e-14)
    for name, slope in slow.items():
        scale = np.abs(np.asarray(slope)).max()
        np.testing.assert_allclose(
            found.slopes[name], slope, rtol=0, atol=1e-11 * scale, err_msg=name
        )
    assert found.members.shape == (
        len(case.records.force),
        3 + 2 + problem.discrepancy.size,
    )
    # A specimen's column: what its rows gain where it is stiffer than both are.
    share = (np.asarray(case.records.specimen) == 1) - 0.5
    own = values["specimen_sd"] * np.asarray(gain) * share
    scale = np.abs(own).max()
    np.testing.assert_allclose(found.members[:, 4], own, rtol=0, atol=1e-11 * scale)


def test_a_moving_gear_padded_is_as_measured():
    rows = 201
    case = moving_case(0, rows=rows)
    problem = build_dynamic(case, dynamic_site_priors(case, "ring"), "ring")
    assert len(problem.time) == bucket_size(rows) > rows
    assert (np.diff(problem.time) > 0.0).all()
    cut = dataclasses.replace(
        problem,
        time=problem.time[:rows],
        force=problem.force[:rows],
        deformation=problem.deformation[:rows],
    )
    values = draw_truth(problem, jax.random.key(3))
    found, slow = EXPAND(problem, values), EXPAND(cut, values)
    np.testing.assert_allclose(float(found[0]), float(slow[0]), **CLOSE)
    for site, slope in slow[1].items():
        scale = np.abs(np.asarray(slope)).max()
        np.testing.assert_allclose(found[1][site], slope, rtol=0, atol=1e-10 * scale)
    motion = np.asarray(MOVE(problem, values))[:rows]
    np.testing.assert_allclose(motion, MOVE(cut, values), rtol=0, atol=1e-12)
