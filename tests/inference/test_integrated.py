"""Compression and integrating out are shortcuts to the dense normal density."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpyro.handlers import seed, trace
from scipy import stats
from slices import slice_of
from structures import form_of

from hdcal.data.case import Case, Gear
from hdcal.data.priors import (
    SCALE_UNITS,
    effect_priors,
    material_priors,
    rig_priors,
)
from hdcal.errors import InputError
from hdcal.inference import compression, likelihood, marginal
from hdcal.inference import values as of_draw
from hdcal.inference.likelihood import log_probability
from hdcal.inference.linear_gaussian import Grouped, Linear, contrasts
from hdcal.inference.members import MEMBER_SD, MEMBERS, integrated_kinds
from hdcal.inference.problem import build_problem
from hdcal.inference.sampled_problem import model
from hdcal.inference.serial_correlation import previous_rows
from hdcal.physics.chain import (
    Base,
    linear_coefficients,
    linear_columns,
    predict_reading,
)

SHIPPED = effect_priors()
log_likelihood = jax.jit(likelihood.log_likelihood)
predict_rows = jax.jit(of_draw.predict_rows)
pointwise = jax.jit(likelihood.pointwise_log_likelihood)


def labelled(loading, seed, *, known, runs=1, specimens=1, sds=(0.0,)):
    """Return the loading with labels, stated sds and some force."""
    rng = np.random.default_rng(seed)
    rows = len(loading.deformation)
    return dataclasses.replace(
        loading,
        deformation=loading.deformation + rng.normal(0.0, 0.01, rows),
        run=np.arange(rows) % runs,
        specimen=np.sort(np.arange(rows) % specimens),
        force_sd=rng.choice(sds, rows),
        force=200.0 * loading.deformation + rng.normal(0.0, 2.0, rows),
        known=frozenset(known),
    )


def case_of(records, gear, *, resolution=0.0):
    material = material_priors("40CrNiMoA")
    rig = rig_priors()
    names = ("K", "force_offset", "deformation_offset", "sigma")
    priors = {name: rig[name] for name in names}
    priors |= {name: material[name] for name in ("E0", "alpha")}
    return Case(
        name="case",
        gear=Gear(
            "gear",
            gear,
            "40CrNiMoA",
            "ring",
            "diametral",
            20.0,
            resolution,
            None,
            priors,
            scale_priors={name: rig[name] for name in SCALE_UNITS},
        ),
        records=records,
        run_labels=tuple(map(str, range(int(records.run.max()) + 1))),
        specimen_labels=tuple(map(str, range(int(records.specimen.max()) + 1))),
        data_sha256="",
    )


def random_values(seed):
    rng = np.random.default_rng(seed)
    return {
        "K": rng.uniform(3.0, 7.0),
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


# --- compression -----------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("rows", "runs", "specimens", "sds"),
    [
        (180, 1, 1, (0.0,)),
        (180, 3, 2, (0.0, 0.7)),
        (3, 1, 1, (0.2,)),
        (9, 4, 2, (0.5,)),
    ],
)
def test_compressed_is_row_by_row(loading, rows, runs, specimens, sds, seed, reading):
    rng = np.random.default_rng(seed)
    some = jax.tree.map(lambda leaf: leaf[:rows], loading)
    records = labelled(some, seed, known=(), runs=runs, specimens=specimens, sds=sds)
    slope, offset = rng.uniform(100.0, 300.0, specimens), rng.normal(0.0, 3.0, runs)
    alpha, zero, sigma, step = 4e-4, 0.01, 0.8, 0.5

    def base(run, specimen):
        return Base(slope[specimen], alpha, zero, offset[run], sigma)

    keys = records.run, records.specimen, records.force_sd, records.force_sd
    distinct, group = compression.group_rows(*keys)
    np.testing.assert_array_equal(distinct[group], np.stack(keys, axis=1))
    columns = linear_columns(records, reading)
    blocks = compression.compress(columns, records.force, distinct, group)
    assert blocks.count.sum() == rows
    # Groups of no rows may follow.
    assert (blocks.count[: len(distinct)] > 0.0).all()
    assert (blocks.count[len(distinct) :] == 0.0).all()
    coefficients = linear_coefficients(base(blocks.run, blocks.specimen), reading)
    coefficients = jnp.broadcast_to(coefficients, (len(blocks.count), 4))
    full = np.concatenate([-coefficients, np.ones((len(blocks.count), 1))], axis=1)
    squares = np.sum(np.einsum("gij,gj->gi", blocks.factor, full) ** 2, axis=1)
    variance = blocks.variance(sigma, step)
    volume = blocks.count * np.log(2.0 * np.pi * variance)
    found = -0.5 * np.sum(volume + squares / variance)

    own = base(records.run, records.specimen)
    mean, noise = predict_reading(own, (), records, reading)
    sd = np.sqrt(noise.sd[0] ** 2 + step**2 / 12.0)
    slow = stats.norm.logpdf(records.force, mean, sd).sum()
    assert float(found) == pytest.approx(slow, rel=1e-11)


def test_a_compressed_problem_is_its_rows(loading, gear):
    records = labelled(loading, 5, known={"force_sd"}, sds=(0.1, 0.4))
    case = case_of(records, gear)
    problem = build_problem(case, SHIPPED, structure=form_of(case))
    assert problem.records is None
    values = random_values(1)
    rows = rows_form(problem, case)
    mean, noise = predict_rows(rows, values, records, None)
    slow = stats.multivariate_normal(
        mean, noise_covariance(records, noise.sd[0], values["noise_correlation"])
    ).logpdf(records.force)
    assert float(log_likelihood(problem, values)) == pytest.approx(slow, rel=1e-11)
    assert float(log_likelihood(rows, values)) == pytest.approx(slow, rel=1e-11)
    # Independent noise is a correlation of none, and another density.
    plain = log_probability(records.force, mean, noise, 0.0, rounded=False).sum()
    independent = {**values, "noise_correlation": 0.0}
    for form in (problem, rows):
        found = float(log_likelihood(form, independent))
        assert found == pytest.approx(float(plain), rel=1e-11)
    assert abs(float(plain) - slow) > 1.0


# --- integrating out ---------------------------------------------------------------


def random_linear(seed, rows, weights, members=0):
    rng = np.random.default_rng(seed)
    grouped = None
    if members:
        # Some may have no row.
        index = jnp.asarray(rng.integers(0, members, rows))
        grouped = Grouped(index, jnp.asarray(2.0 * rng.normal(size=rows)), members)
    return Linear(
        residual=jnp.asarray(rng.normal(0.0, 2.0, rows)),
        design=jnp.asarray(rng.normal(size=(rows, weights))) * 1.5,
        log_scale=jnp.asarray(0.5 * rows * np.log(2.0 * np.pi)),
        grouped=grouped,
    )


def dense(linear):
    """Return the design of members and scores as one dense matrix."""
    design = np.asarray(linear.design)
    if linear.grouped is not None:
        design = np.hstack([linear.grouped.columns(), design])
    return design


@pytest.mark.parametrize(
    ("rows", "weights", "members"),
    [(30, 4, 0), (5, 12, 0), (1, 1, 0), (30, 4, 7), (30, 0, 7), (5, 3, 9), (9, 0, 2)],
)
def test_the_integral_is_the_dense_density(rows, weights, members):
    linear = random_linear(rows, rows, weights, members)
    design = dense(linear)
    covariance = design @ design.T + np.eye(rows)
    law = stats.multivariate_normal(np.zeros(rows), covariance)
    slow = law.logpdf(linear.residual)
    assert float(linear.log_likelihood()) == pytest.approx(slow, rel=1e-11)


@pytest.mark.parametrize(
    ("rows", "weights", "members"),
    [(30, 4, 0), (3, 5, 0), (30, 3, 6), (20, 0, 5), (4, 2, 6)],
)
def test_draws_are_conditional(rows, weights, members):
    linear = random_linear(rows + 1, rows, weights, members)
    design = dense(linear)
    covariance = np.linalg.inv(np.eye(design.shape[1]) + design.T @ design)
    mean = covariance @ design.T @ np.asarray(linear.residual)
    count = 40_000
    keys = jax.random.split(jax.random.key(rows), count)
    drawn, own = jax.jit(jax.vmap(linear.draw))(keys)
    drawn = np.asarray(drawn)
    if members:
        assert np.abs(own.sum(axis=1)).max() < 1e-12
        drawn = np.hstack([own @ contrasts(members), drawn])
    root = np.linalg.cholesky(covariance)
    standard = np.linalg.solve(root, (drawn - mean).T)
    bound = 5.0 / np.sqrt(count)
    assert np.max(np.abs(standard.mean(axis=1))) < bound
    spread = standard @ standard.T / count - np.eye(len(standard))
    assert np.max(np.abs(spread)) < bound * np.sqrt(2.0)


@pytest.mark.usefixtures("loading")  # which is in double precision
@pytest.mark.parametrize("eliminated", [True, False])
@pytest.mark.parametrize("spread", [1.0, 1e4, 1e7])
def test_members_that_spread_far_keep_their_digits(spread, eliminated):
    """Balanced one-way layout: groups and residuals are independent sums of squares."""
    members, rows, sd = 6, 4, 1e-1
    rng = np.random.default_rng(0)
    wide = np.asarray(contrasts(members)) @ rng.normal(size=members - 1)
    residual = spread * sd * np.repeat(wide, rows) + sd * rng.normal(
        size=members * rows
    )
    index = np.repeat(np.arange(members), rows)
    grouped = Grouped(index, np.full(len(index), spread), members)
    none = np.zeros((len(index), 0))
    log_scale = len(index) * np.log(sd * np.sqrt(2.0 * np.pi))
    linear = Linear(
        residual / sd,
        none if eliminated else np.asarray(grouped.columns()),
        log_scale,
        grouped if eliminated else None,
    )
    means = residual.reshape(members, rows).mean(axis=1)
    within = np.sum((residual - np.repeat(means, rows)) ** 2)
    between = rows * np.sum((means - means.mean()) ** 2)
    wide = sd**2 * (1.0 + rows * spread**2)
    squares = (within + len(index) * means.mean() ** 2) / sd**2 + between / wide
    exact = -0.5 * (squares + (members - 1) * np.log(wide / sd**2)) - log_scale
    assert float(linear.log_likelihood()) == pytest.approx(exact, abs=1e-5)


def test_contrasts_are_deviations():
    for count in (2, 3, 7):
        basis = np.asarray(contrasts(count))
        assert basis.shape == (count, count - 1)
        np.testing.assert_allclose(basis.sum(axis=0), 0.0, atol=1e-14)
        centring = np.eye(count) - 1.0 / count
        np.testing.assert_allclose(basis @ basis.T, centring, atol=1e-14)


def noise_covariance(records, sd, correlation):
    """The covariance of a first-order autoregression within each run [N²]."""
    sd = np.asarray(sd)
    run = np.asarray(records.run) + 1000 * np.asarray(records.specimen)
    place = np.array([np.sum(run[:row] == run[row]) for row in range(len(run))])
    apart = np.abs(place[:, None] - place)
    alike = np.where(run[:, None] == run, correlation**apart, 0.0)
    return alike * np.outer(sd, sd)


def dense_log_likelihood(problem, case, values):
    """The dense normal density of all readings, members in the covariance."""
    records = case.records
    mean, noise = predict_rows(problem, values, records, None)
    rows = len(records.force)
    total = np.sqrt(np.asarray(noise.sd[0]) ** 2 + problem.step**2 / 12.0)
    covariance = noise_covariance(records, total, values["noise_correlation"])
    if "run" in problem.integrated:
        centring = np.eye(problem.runs) - 1.0 / problem.runs
        covariance += (
            values["run_offset_sd"] ** 2 * centring[records.run][:, records.run]
        )
    if "specimen" in problem.integrated:
        # A specimen's share of the stiffness scales all but the zero of the force.
        elastic = np.asarray(mean) - values["force_offset"]
        centring = np.eye(problem.specimens) - 1.0 / problem.specimens
        own = centring[records.specimen][:, records.specimen]
        covariance += values["specimen_sd"] ** 2 * np.outer(elastic, elastic) * own
    if "discrepancy" in problem.integrated:
        gap = problem.discrepancy
        basis = np.asarray(gap.columns(records.deformation, records.sense))
        sd = np.asarray(gap.prior_sd(values["gap_sd"], values["gap_length"]))
        covariance += (basis * sd**2) @ basis.T
    law = stats.multivariate_normal(np.zeros(rows), covariance)
    return law.logpdf(records.force - np.asarray(mean))


STRUCTURES = {
    "runs": ({"run"}, False),
    "specimens": ({"specimen"}, False),
    "gap": (set(), True),
    "runs and gap": ({"run", "force_sd"}, True),
    "all": ({"run", "specimen", "force_sd"}, True),
    "more specimens": ({"run", "specimen"}, True),
}


@pytest.fixture(params=slice_of(sorted(STRUCTURES), ["runs and gap"]))
def structured(request, loading, gear):
    known, with_gap = STRUCTURES[request.param]
    records = labelled(
        loading,
        11,
        known=known,
        runs=4 if "run" in known else 1,
        specimens=6 if "more" in request.param else 3 if "specimen" in known else 1,
        sds=(0.1, 0.6) if "force_sd" in known else (0.0,),
    )
    case = case_of(records, gear, resolution=0.3)
    form = form_of(case, (), with_gap)
    problem = build_problem(case, SHIPPED, structure=form)
    return case, problem


def rows_form(problem, case):
    """Return the same problem with its rows kept."""
    columns = None
    if problem.discrepancy is not None:
        columns = problem.discrepancy.columns(
            case.records.deformation, case.records.sense
        )
    return dataclasses.replace(
        problem,
        records=case.records,
        blocks=None,
        columns=columns,
        before=previous_rows(case.records),
    )


@pytest.mark.parametrize("seed", range(2))
def test_blocks_rows_and_dense_agree(structured, seed):
    case, problem = structured
    values = random_values(seed)
    assert problem.blocks is not None
    assert problem.integrated
    slow = dense_log_likelihood(problem, case, values)
    found = float(log_likelihood(problem, values))
    assert found == pytest.approx(slow, rel=1e-10)
    if "specimen" not in problem.integrated:
        rows = float(log_likelihood(rows_form(problem, case), values))
        assert rows == pytest.approx(slow, rel=1e-10)


def test_a_draw_holds_what_is_said_of_it(structured):
    case, problem = structured
    sites = trace(seed(model, jax.random.key(0))).get_trace(problem)
    values = {
        name: site["value"]
        for name, site in sites.items()
        if site["type"] in ("sample", "deterministic") and not name.startswith("_")
    }
    values = {name: value for name, value in values.items() if name != "force"}
    values |= jax.jit(marginal.draw_members)(problem, values, jax.random.key(0))
    shapes = {name: np.shape(value) for name, value in values.items()}
    with_gap = problem.discrepancy is not None
    assert shapes == of_draw.site_shapes(case, (), form_of(case, (), with_gap))


def test_drawn_members_explain_the_data(structured):
    """Given the members the readings scatter by σ, and deviations sum to zero."""
    case, problem = structured
    values = random_values(0)
    drawn = jax.jit(marginal.draw_members)(problem, values, jax.random.key(0))
    assert set(drawn) == {MEMBERS[kind] for kind in problem.integrated}
    for name in set(drawn) - {"gap_weights"}:
        assert abs(float(drawn[name].sum())) < 1e-9
    # Bayes: p(y) = p(y | w) p(w) / p(w | y), with the two latter from dense algebra.
    linear = jax.jit(marginal.linear_part)(problem, values)
    scores = scores_of(problem, values, drawn)
    design = dense(linear)
    posterior = np.linalg.inv(np.eye(design.shape[1]) + design.T @ design)
    mean = posterior @ design.T @ np.asarray(linear.residual)
    own = slow_given_members(problem, case, values, drawn)
    bayes = own + stats.norm.logpdf(scores).sum() - log_normal(scores - mean, posterior)
    whole = float(log_likelihood(problem, values))
    assert whole == pytest.approx(bayes, rel=1e-7)


def test_the_law_of_a_leftover_is_that_of_its_draws(structured):
    _, problem = structured
    if "discrepancy" not in problem.integrated:
        return
    values, count = random_values(0), 20_000

    def draw(key):
        return marginal.draw_members(problem, values, key)["gap_weights"]

    drawn = jax.jit(jax.vmap(draw))(jax.random.split(jax.random.key(1), count))
    mean, root = map(np.asarray, jax.jit(marginal.gap_distribution)(problem, values))
    sd = np.linalg.norm(root, axis=1)
    assert np.all(np.abs(np.mean(drawn, axis=0) - mean) < 5.0 * sd / np.sqrt(count))
    off = np.cov(np.asarray(drawn).T) - root @ root.T
    assert np.all(np.abs(off) < 0.06 * np.outer(sd, sd))


def log_normal(error, covariance):
    root = np.linalg.cholesky(covariance)
    score = np.linalg.solve(root, error)
    return stats.norm.logpdf(score).sum() - np.log(np.diag(root)).sum()


def scores_of(problem, values, drawn):
    """Return the scores behind drawn members, in the order of the dense design."""
    parts = [np.zeros(0)]
    for kind, count in (("run", problem.runs), ("specimen", problem.specimens)):
        if kind in problem.integrated:
            member = drawn[MEMBERS[kind]] / values[MEMBER_SD[kind]]
            parts.append(contrasts(count).T @ member)
    parts.sort(key=len, reverse=True)
    if "discrepancy" in problem.integrated:
        sd = problem.discrepancy.prior_sd(values["gap_sd"], values["gap_length"])
        parts.append(drawn["gap_weights"] / np.asarray(sd))
    return np.concatenate(parts)


def slow_given_members(problem, case, values, drawn):
    """Return the log density of all readings when the members are known."""
    rows = rows_form(problem, case)
    given = pointwise(
        rows, {**values, **drawn}, case.records, rows.columns, rows.before
    )
    return float(given.sum())


@pytest.mark.parametrize(
    ("runs", "specimens", "resolution", "words"),
    [
        (10_001, 1, 0.0, "10001 runs are too many for one calibration. Give it 10000"),
        (600, 600, 0.0, "too many for one calibration with effects, coarse"),
        (
            600,
            1,
            50.0,
            "600 runs are too many for one calibration with effects",
        ),
    ],
)
def test_too_many_members_are_refused(
    loading, gear, runs, specimens, resolution, words
):
    """Their number is what would take hours or the memory, so it is said at once."""
    rows = max(runs, specimens) * 2
    many = jax.tree.map(lambda leaf: np.resize(np.asarray(leaf), rows), loading)
    known = {"run"} | ({"specimen"} if specimens > 1 else set())
    records = labelled(many, 1, known=known, runs=runs, specimens=specimens)
    with pytest.raises(InputError, match=words):
        build_problem(case_of(records, gear, resolution=resolution), SHIPPED)


@pytest.mark.parametrize(
    ("linear", "counts", "order"),
    [
        ({"run", "specimen"}, {"run": 600, "specimen": 60}, ("run", "specimen")),
        ({"run", "discrepancy"}, {"run": 600, "specimen": 70}, ("run",)),
        (
            {"run", "specimen", "discrepancy"},
            {"discrepancy": 2000, "run": 60, "specimen": 900},
            ("specimen", "run", "discrepancy"),
        ),
    ],
)
def test_the_more_numerous_kind_is_eliminated(linear, counts, order):
    assert integrated_kinds("case", counts, frozenset(linear)) == order
    other = ({"run", "specimen"} - {order[0]}).pop()
    with pytest.raises(InputError, match=f"600 {other}s are too many"):
        integrated_kinds("case", counts | {other: 600}, frozenset(linear) - {other})


def test_runs_by_the_thousand_are_integrated_out(loading, gear):
    many = jax.tree.map(lambda leaf: np.resize(np.asarray(leaf), 4_000), loading)
    records = labelled(many, 1, known={"run"}, runs=2_000)
    case = case_of(records, gear)
    problem = build_problem(case, SHIPPED, structure=form_of(case))
    values = random_values(3)
    linear = jax.jit(marginal.linear_part)(problem, values)
    # No array has an entry for each pair of runs.
    largest = max(leaf.size for leaf in jax.tree.leaves(linear))
    assert largest <= 2_000 * 15
    assert np.isfinite(log_likelihood(problem, values))
