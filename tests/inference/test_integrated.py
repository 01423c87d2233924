"""Compression and integrating out are shortcuts to the dense normal density."""

from dataclasses import replace

import jax
import numpy as np
import pytest
from rigs import make_case, make_gear
from scipy import stats
from slices import slice_of
from structures import form_of

from hdcal.data.priors import effect_priors
from hdcal.errors import InputError
from hdcal.inference.force_model.marginal import Linear, contrasts, draw_members
from hdcal.inference.force_model.problem import Problem, build_problem
from hdcal.inference.force_model.values import MEMBERS

# Known covariates, number of specimens, stated sds of a reading, discrepancy.
STRUCTURES = {
    "rows": ({"run"}, 1, (0.1, 0.6), True),
    "compressed": ({"run", "specimen"}, 3, (0.0,), True),
    "one sd": ({"run"}, 1, (0.4,), False),
    "specimens": ({"specimen"}, 6, (0.0,), False),
    "discrepancy": (set(), 1, (0.0,), True),
    "independent": ({"run"}, 1, (0.0,), False),
}
log_likelihood = jax.jit(Problem.log_likelihood)


def values_of(seed: int) -> dict:
    rng = np.random.default_rng(seed)
    return {
        "K": rng.uniform(1.0, 3.0),
        "E0": rng.normal(207e3, 3e3),
        "alpha": rng.uniform(0.0, 1e-3),
        "force_offset": rng.normal(0.0, 3.0),
        "deformation_offset": rng.normal(0.0, 0.01),
        "sigma": rng.uniform(0.3, 2.0),
        "noise_correlation": rng.uniform(0.1, 0.9),
        "run_offset_sd": rng.uniform(0.5, 4.0),
        "specimen_sd": rng.uniform(0.02, 0.2),
        "gap_sd": rng.uniform(0.5, 4.0),
        "gap_length": rng.uniform(0.1, 1.0),
    }


def problem_of(name: str, loading, resolution: float = 0.3):
    """Return a case whose runs take turns, and its problem."""
    known, specimens, sds, with_gap = STRUCTURES[name]
    rng, rows = np.random.default_rng(11), len(loading.force)
    records = replace(
        loading,
        deformation=loading.deformation + rng.normal(0.0, 0.01, rows),
        run=np.arange(rows) % (4 if "run" in known else 1),
        specimen=np.sort(np.arange(rows) % specimens),
        force_sd=rng.choice(sds, rows),
        force=200.0 * loading.deformation + rng.normal(0.0, 2.0, rows),
        known=frozenset(known | {"temperature", "unloading"}),
    )
    case = make_case(records, make_gear(resolution=resolution, reading="diametral"))
    form = form_of(case, (), with_gap)
    if name == "independent":
        form = replace(form, correlated=False)
    return case, build_problem(case, effect_priors(), structure=form)


def dense(problem, case, values):
    """Return mean, covariance of the noise, and of each kind design and covariance."""
    records, rows = case.records, len(case.records.force)
    slope = values["K"] * values["E0"] * problem.unit_stiffness * 0.5
    warm = 1.0 - values["alpha"] * (records.temperature - 20.0)
    elastic = slope * warm * (records.deformation - values["deformation_offset"])
    sd = np.hypot(np.hypot(values["sigma"], records.force_sd), 0.3 / np.sqrt(12.0))
    group = np.asarray(records.run) + 1000 * np.asarray(records.specimen)
    place = np.array([np.sum(group[:row] == group[row]) for row in range(rows)])
    power = np.abs(place[:, None] - place)
    rho = values["noise_correlation"] if problem.correlated else 0.0
    alike = np.where(group[:, None] == group, rho**power, 0.0)
    kinds = {}
    for kind, scale, size in (
        ("run", "run_offset_sd", np.ones(rows)),
        ("specimen", "specimen_sd", elastic),
    ):
        count = len(getattr(case, f"{kind}_labels"))
        if count > 1:
            centring = np.eye(count) - 1.0 / count
            one_hot = np.asarray(getattr(records, kind))[:, None] == np.arange(count)
            kinds[kind] = size[:, None] * one_hot, values[scale] ** 2 * centring
    if (gap := problem.discrepancy) is not None:
        basis = np.asarray(gap.columns(records.deformation, records.sense))
        weight = np.asarray(gap.prior_sd(values["gap_sd"], values["gap_length"]))
        kinds["discrepancy"] = basis, np.diag(weight**2)
    return elastic + values["force_offset"], alike * np.outer(sd, sd), kinds


@pytest.mark.parametrize("name", slice_of(STRUCTURES, ["rows", "compressed"]))
def test_the_density_is_the_dense_one(name: str, loading):
    case, problem = problem_of(name, loading)
    assert (problem.records is None) == (name != "rows")
    for values in map(values_of, range(2)):
        mean, covariance, kinds = dense(problem, case, values)
        assert {*kinds} == {*problem.integrated}
        for design, prior in kinds.values():
            covariance = covariance + design @ prior @ design.T
        law = stats.multivariate_normal(mean, covariance)
        found = float(log_likelihood(problem, values))
        assert found == pytest.approx(law.logpdf(case.records.force), rel=1e-10)


@pytest.mark.parametrize("name", slice_of(["rows", "compressed"], ["compressed"]))
def test_draws_of_members_have_the_conditional_distribution(name: str, loading):
    case, problem = problem_of(name, loading)
    values, count = values_of(0), 4000
    keys = jax.random.split(jax.random.key(1), count)
    draw = jax.jit(jax.vmap(lambda key: draw_members(problem, values, key)))
    drawn = {n: np.asarray(v) for n, v in draw(keys).items()}
    mean, covariance, kinds = dense(problem, case, values)
    assert drawn.keys() == {MEMBERS[kind] for kind in kinds}
    every = np.hstack([drawn[MEMBERS[kind]] for kind in kinds])
    design = np.hstack([design for design, _ in kinds.values()])
    prior = np.zeros((design.shape[1],) * 2)
    place = 0
    for _, one in kinds.values():
        prior[place : place + len(one), place : place + len(one)] = one
        place += len(one)
    gain = np.linalg.solve(design @ prior @ design.T + covariance, design @ prior).T
    centre = gain @ (np.asarray(case.records.force) - mean)
    spread = prior - gain @ design @ prior
    sd = np.sqrt(np.diag(spread))
    assert np.all(np.abs(every.mean(axis=0) - centre) < 5.0 * sd / np.sqrt(count))
    off = np.cov(every.T) - spread
    assert np.all(np.abs(off) < 5.0 * np.outer(sd, sd) / np.sqrt(count / 2.0))


@pytest.mark.parametrize("spread", [1.0, 1e7])
def test_members_that_spread_far_keep_their_digits(spread: float):
    """Balanced one-way layout: groups and residuals are independent sums of squares."""
    members, rows, sd = 6, 4, 1e-1
    rng, basis = np.random.default_rng(0), np.asarray(contrasts(members))
    np.testing.assert_allclose(basis @ basis.T, np.eye(6) - 1.0 / 6.0, atol=1e-14)
    wide = spread * sd * basis @ rng.normal(size=members - 1)
    residual = np.repeat(wide, rows) + sd * rng.normal(size=members * rows)
    log_scale = len(residual) * np.log(sd * np.sqrt(2.0 * np.pi))
    design = spread * np.repeat(basis, rows, axis=0)
    with jax.enable_x64(True):
        found = float(Linear(residual / sd, design, log_scale).log_likelihood())
    means = residual.reshape(members, rows).mean(axis=1)
    within = np.sum((residual - np.repeat(means, rows)) ** 2)
    between = rows * np.sum((means - means.mean()) ** 2)
    ratio = 1.0 + rows * spread**2
    squares = within + len(residual) * means.mean() ** 2 + between / ratio
    exact = -0.5 * (squares / sd**2 + (members - 1) * np.log(ratio)) - log_scale
    assert found == pytest.approx(exact, abs=1e-5)


@pytest.mark.parametrize("kind", ["run", "specimen"])
def test_too_many_members_are_refused(kind: str, loading):
    many = jax.tree.map(lambda leaf: np.resize(np.asarray(leaf), 201), loading)
    labels = {"run": np.zeros(201, int), "specimen": np.zeros(201, int)}
    labels |= {kind: np.arange(201)}
    records = replace(many, **labels, known=frozenset({kind}))
    with pytest.raises(InputError, match=f"201 {kind}s are too many"):
        build_problem(make_case(records), effect_priors())
