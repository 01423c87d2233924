"""The budget of a margin holds what is known to be in it, and adds up."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from gauged import certified
from posteriors import (
    batch,
    compensated,
    plain_draws,
    ramp_case,
    single,
    stiffer,
    with_leftover,
    written_posterior,
)
from rigs import make_gear

import hdcal
from hdcal.inference.posterior import Posterior
from hdcal.prediction.engine.causes import causes_of
from hdcal.prediction.engine.population_force import PopulationForce, population_force
from hdcal.prediction.margin.budget import ForceBudget, averaged_budget
from hdcal.prediction.margin.uncertainty import PredictiveLaw

SIZE = 2000


def forces_of(models, at=0.4, warm=20.0, population="readings", **asked):
    return [
        population_force(cause, at, population, **asked).at(warm)
        for cause in causes_of(models)
    ]


def by_name(found: ForceBudget) -> dict[str, float]:
    """Return what each component brings to the variance."""
    return {part.name: part.variance for part in found.components}


def totals(
    found: ForceBudget, forces: Sequence[PopulationForce]
) -> tuple[float, float]:
    """Return the variance that a budget holds, and the one that Monte Carlo has.

    Those of Student's t are scales: a part each of ν/(ν − 2) of the sd's square.
    """
    _, sd = PredictiveLaw.of(forces).moments()
    wide = [
        part.variance * (part.dof / (part.dof - 2.0) if np.isfinite(part.dof) else 1.0)
        for part in found.components
    ]
    return sum(wide), sd**2


def check_total(found: ForceBudget, forces: Sequence[PopulationForce]) -> None:
    """Require a budget to hold the variance that Monte Carlo has."""
    held, expected = totals(found, forces)
    assert held == pytest.approx(expected, rel=0.03)


def known_parts(gear) -> tuple[Posterior, dict]:
    """Return a posterior in which all adds up, and the variances at 0.4 mm, 60 °C."""
    case = ramp_case(gear)
    draws = plain_draws(case, SIZE) | {
        "sigma": np.full(SIZE, 0.8),
        "deformation_offset": np.zeros(SIZE),
    }
    at = 0.4 * draws["stiffness"] * (1.0 - 3e-4 * 40.0) + draws["force_offset"]
    parts = {
        "calibration": np.var(at),
        "noise": 0.64,
        "alpha": np.var(0.4 * 205.0 * 40.0 * draws["alpha"]),
    }
    return written_posterior(case, draws), parts


def test_the_rows_are_the_variances_of_a_sum():
    posterior, parts = known_parts(compensated())
    forces = forces_of(posterior, warm=60.0)
    found = by_name(averaged_budget(forces))
    assert found.keys() == parts.keys()
    for name, variance in parts.items():
        assert found[name] == pytest.approx(variance, rel=0.1), name
    # On a rig that drifts by 0.1 N and a micrometre per kelvin, 40 K away.
    case = replace(posterior.case, gear=make_gear())
    found = averaged_budget(forces_of(replace(posterior, case=case), warm=60.0))
    rows = {part.name: part for part in found.components}
    assert rows["zero_drift"].sensitivity == pytest.approx(40.0)
    assert rows["zero_drift"].variance == pytest.approx((40.0 * 0.1) ** 2)
    warm = 1e-3 * 205.0 * (1.0 - 3e-4 * 40.0)
    assert rows["frame"].variance == pytest.approx((40.0 * warm) ** 2, rel=0.01)


EVERYTHING = {
    "one gear": (lambda: single(size=SIZE), {}),
    "rounded": (lambda: single(make_gear(resolution=0.98), SIZE), {}),
    "its load": (lambda: single(size=SIZE), {"quantity": "load"}),
    "warm": (lambda: single(size=SIZE), {"warm": 70.0}),
    "leftover": (lambda: with_leftover(SIZE), {"at": 0.5}),
    "mountings": (lambda: batch(6, SIZE), {"population": "mountings"}),
    "a size": (lambda: single(size=SIZE), {"tolerances": {"wall_thickness": 0.01}}),
    "pulled": (lambda: single(size=SIZE), {"at": -0.3}),
}


@pytest.mark.parametrize("name", EVERYTHING)
def test_the_variance_is_that_of_monte_carlo(name: str):
    """In the mean of some seeds: one moves what is beyond the tested by a percent."""
    make, asked = EVERYTHING[name]
    model, seeds = make(), range(4)
    drawn = [forces_of(model, seed=seed, **asked) for seed in seeds]
    each = [totals(averaged_budget(forces), forces) for forces in drawn]
    held, expected = np.mean(each, axis=0)
    assert held == pytest.approx(expected, rel=0.03)


def test_a_budget_that_ignores_the_covariance_is_told_from_the_true_one():
    """The wrong twin: the same draws of each parameter, no longer tied together."""
    posterior, rng = single(size=SIZE), np.random.default_rng(4)
    apart = {name: rng.permutation(column) for name, column in posterior.draws.items()}
    untied = written_posterior(posterior.case, apart)
    forces = forces_of(posterior, at=0.1)
    check_total(averaged_budget(forces), forces)
    with pytest.raises(AssertionError):
        check_total(averaged_budget(forces_of(untied, at=0.1)), forces)


def test_what_the_data_say_nothing_of_has_its_row_with_all_that_hangs_on_it():
    """A load cell with a gain: the stiffness is the larger where it reads too much."""
    case = ramp_case(certified(compensated(), force_gain=0.0025))
    draws, rng = plain_draws(case, SIZE), np.random.default_rng(6)
    gain = rng.normal(0.0, 0.0025, SIZE)
    cells = draws | {name: draws[name] * (1.0 + gain) for name in ("K", "stiffness")}
    posterior = written_posterior(case, cells | {"force_gain": gain})
    found = averaged_budget(forces_of(posterior, quantity="load"))
    row = {part.name: part for part in found.components}["force_gain"]
    assert row.driven_by == "prior"
    assert row.standard_uncertainty == pytest.approx(0.0025, rel=0.05)
    assert row.sensitivity == pytest.approx(0.4 * 205.0, rel=0.1)
    (line,) = (
        line
        for line in hdcal.margin(posterior, 0.4, quantity="load").budget
        if line.component == "load cell, certificate"
    )
    assert (line.type, line.unit) == ("B", "%")
    assert line.standard_uncertainty == pytest.approx(0.25, rel=0.05)
    assert line.sensitivity_N_per_unit == pytest.approx(0.82, rel=0.1)


@pytest.mark.thorough
def test_what_draws_show_by_chance_is_no_tie():
    """At 40 K the loss of modulus moves a force by 40 times as much, whatever draws."""
    posterior = single(size=400)
    draws = {n: np.array(v) for n, v in posterior.draws.items()}
    zero = draws["force_offset"] - draws["force_offset"].mean()
    draws["alpha"] += 0.1 * zero / zero.std() * draws["alpha"].std()
    tied = written_posterior(posterior.case, draws)
    found = hdcal.margin(tied, 0.4, temperature=60.0, quantity="load")
    rows = {line.component: line for line in found.budget}
    line = rows["loss of modulus per kelvin α"]
    cold = hdcal.margin(tied, 0.4, temperature=20.0, quantity="load").estimate_N
    assert line.sensitivity_N_per_unit == pytest.approx(-40.0 * cold, rel=0.03)


@pytest.mark.parametrize("seed", range(5))
def test_a_ridge_to_an_unknown_zero_leaves_the_calibration_its_row(seed: int):
    """On one ramp the two zeros hang together, and stiffness with neither."""
    case, rng = ramp_case(), np.random.default_rng(seed)
    draws = plain_draws(case, SIZE)
    zero, slope = rng.normal(-1.0, 3.0, SIZE), rng.normal(205.0, 0.2, SIZE)
    draws["K"] *= slope / draws["stiffness"]
    draws |= {"force_offset": zero, "stiffness": slope}
    # Where the rows have their middle the force is known well.
    middle = 205.0 * 0.28 - 1.0 + rng.normal(0.0, 0.02, SIZE)
    draws["deformation_offset"] = 0.28 - (middle - zero) / slope
    found = written_posterior(case, draws)
    of_zero = replace(found.diagnoses["force_offset"], driven_by="prior")
    of_all = {**found.diagnoses, "force_offset": of_zero}
    (force,) = forces_of(replace(found, diagnoses=of_all))
    exact = float(np.var(np.asarray(force.mixture().centre())))
    rows = by_name(averaged_budget([force]))
    # Student's t of few degrees of freedom: what of σ is known beside it is taken off.
    assert rows["calibration"] == pytest.approx(exact, rel=0.2)


def test_a_trace_of_a_second_cause_brings_no_degrees_of_freedom():
    """Fit and noise have one unknown variance, under two causes too."""
    one = single(size=SIZE)
    alone = averaged_budget(forces_of(one))
    traced = averaged_budget(forces_of([(0.999, one), (0.001, stiffer(one, 1.001))]))
    assert alone.dof < 1000.0
    assert traced.dof == pytest.approx(alone.dof, rel=0.05)


def test_what_causes_differ_by_is_no_error_of_the_draws():
    one = single(size=SIZE)
    apart = forces_of([(0.9, one), (0.1, stiffer(one, 1.02))])
    law = PredictiveLaw.of(apart)
    mean, sd = law.moments()
    end = mean - 1.96 * sd, mean + 1.96 * sd
    found = law.end_error(end, [1000.0, 1000.0])
    # The scatter over halves of the draws, of all causes alike.
    ends = []
    for rows in np.array_split(np.random.default_rng(1).permutation(SIZE), 20):
        some = [
            PredictiveLaw(*([part[rows]] for part in parts))
            for parts in zip(law.weight, law.mean, law.sd, strict=True)
        ]
        share = [sum(np.sum(b) for b in one._below(end[1])) for one in some]
        ends.append(20.0 * sum(share))
    step = 0.1 * sd
    near = [sum(map(np.sum, law._below(end[1] + s))) for s in (-step, step)]
    expected = np.std(ends) / np.sqrt(10.0) / ((near[1] - near[0]) / (2.0 * step))
    assert found == pytest.approx(expected, rel=0.6)


def test_every_source_has_its_row_and_the_shares_sum_to_one():
    gears = batch(6, 400)
    asked = {"tolerances": {"wall_thickness_mm": 0.02}, "temperature": 60.0}
    models = [(0.6, gears), (0.4, stiffer(gears, 1.05))]
    found = hdcal.margin(models, 0.6, **asked)
    shares = [line.share for line in found.budget]
    assert sum(shares) == pytest.approx(1.0, abs=1e-12)
    assert shares == sorted(shares, reverse=True) and min(shares) > 0.0
    assert {line.component for line in found.budget} >= {
        "calibration (stiffness, zeros)",
        "reading noise",
        "which effect is at work",
        "loss of modulus per kelvin α",
        "mounting to mounting",
        "gear to gear",
        "wall thickness δ",
        "leftover beyond the tested range",
        "zero of the gauge with temperature",
        "frame with temperature",
    }
    check = found.linear_check
    total = sum(line.contribution_N**2 for line in found.budget)
    assert check.standard_uncertainty_N == pytest.approx(np.sqrt(total))
    for line in found.budget:
        brought = line.standard_uncertainty * abs(line.sensitivity_N_per_unit)
        assert brought == pytest.approx(line.contribution_N), line.component
        assert line.share == pytest.approx(line.contribution_N**2 / total)
        assert line.halved_by
    assert found.causes == pytest.approx({"none": 1.0})


def test_the_spread_between_causes_is_that_of_their_forces():
    first = single(size=SIZE)
    models = [(0.7, first), (0.3, stiffer(first, 1.1))]
    forces = forces_of(models)
    found = averaged_budget(forces)
    means = [averaged_budget([force]).estimate for force in forces]
    between = 0.7 * 0.3 * (means[0] - means[1]) ** 2
    assert by_name(found)["cause"] == pytest.approx(between)
    check_total(found, forces)


def exact(size: int = 400, sigma: float = 1.5, **gear) -> Posterior:
    """Return one gear of which all is known but the noise."""
    case = ramp_case(compensated(make_gear(**gear)))
    draws = {name: np.full(size, v.mean()) for name, v in plain_draws(case).items()}
    # The product of the means is not the mean of the product.
    unit = plain_draws(case)["stiffness"] / np.prod(
        [plain_draws(case)[name] for name in ("K", "E0")], axis=0
    )
    draws["K"] = draws["stiffness"] / draws["E0"] / unit[:size]
    return written_posterior(case, draws | {"sigma": np.full(size, sigma)})


def test_a_straight_budget_is_valid_and_given():
    found = hdcal.margin(exact(), 0.4)
    assert found.linear_budget_valid is True
    assert found.combined_standard_uncertainty_N == pytest.approx(1.5, rel=1e-3)
    assert found.coverage_factor == pytest.approx(1.96, abs=1e-3)
    assert found.expanded_uncertainty_N == pytest.approx(2.94, abs=0.003)
    ends = found.coverage_lo_N, found.coverage_hi_N
    assert ends == pytest.approx(
        (found.estimate_N - 2.94, found.estimate_N + 2.94), abs=0.003
    )


@pytest.mark.thorough
def test_a_budget_that_does_not_stand_gives_way_to_monte_carlo():
    """A wide tolerance is rectangular, and the force its third power."""
    found = hdcal.margin(exact(), 0.4, tolerances={"wall_thickness_mm": 0.1})
    assert found.linear_budget_valid is False
    member = found.worst.member_N
    assert (found.coverage_lo_N, found.coverage_hi_N) == (member.lo, member.hi)
    check = found.linear_check
    assert abs(check.hi_N - member.hi) > check.tolerance_N
    assert found.budget and sum(s.share for s in found.budget) == pytest.approx(1.0)


def test_too_few_draws_are_said():
    found = hdcal.margin(single(size=200), 0.4, quantity="load")
    assert found.linear_budget_valid is False


def test_without_sensitivities_monte_carlo_speaks_alone():
    found = hdcal.margin(single(size=200), 0.4, sensitivities=False)
    assert found.budget == () and found.linear_budget_valid is None
    assert found.coverage_hi_N == found.worst.member_N.hi
