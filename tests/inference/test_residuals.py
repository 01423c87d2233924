"""Shapes and faults of residuals are found where they are, and rarely in noise."""

from dataclasses import replace

import numpy as np
import pytest
from rigs import autoregression, cycles, make_records
from scipy import stats
from slices import slice_of

import hdcal
from hdcal.data.prior import Prior
from hdcal.data.priors import rig_priors
from hdcal.inference.force_model.residual_shapes import (
    FALSE_ALARM,
    Correlated,
    Whitened,
    find_structure,
    orthonormal,
    shapes_of,
)
from hdcal.inference.force_model.residuals import (
    NEIGHBOURS,
    SCATTER,
    WILD,
    noise_faults,
    residuals,
)
from hdcal.inference.force_model.serial_correlation import (
    CORRELATION,
    previous_rows,
    whiten,
    whitened_products,
)

# Time that is not just the order of the rows.
RECORDS = replace(cycles(96), time=np.arange(96.0) ** 2)
SHAPES = shapes_of(RECORDS, 20.0)
CORRELATED = Correlated(previous_rows(RECORDS), rig_priors()[CORRELATION])
WIDE = Prior("beta", (0.5, 1.5))
ROWS = 60
X = np.linspace(0.02, 0.54, ROWS)


def correlated(rho: float, rng, rows: int = ROWS, run=None) -> np.ndarray:
    """Return a first-order autoregression of sd 1, starting anew in each run."""
    run = np.zeros(rows, int) if run is None else run
    return autoregression(rng.normal(size=rows), run, rho)


def rarely(alarms: int, count: int, share: float = FALSE_ALARM) -> bool:
    return stats.binomtest(alarms, count, share, "greater").pvalue > 1e-3


def test_whitened_noise_is_independent():
    run, rho = np.arange(12) % 3, 0.7
    before = previous_rows(make_records(np.arange(12.0), run=run))
    power = np.abs(np.arange(12)[:, None] - np.arange(12)) // 3
    covariance = np.where(run[:, None] == run, rho**power, 0.0)
    root = whiten(np.linalg.cholesky(covariance), before, rho)
    np.testing.assert_allclose(root @ root.T, np.eye(12), atol=1e-12)
    # Two rows below those of the data are independent.
    table = np.random.default_rng(0).normal(size=(14, 3))
    products, volume = whitened_products(table, before, np.array([0.0, rho]))
    np.testing.assert_allclose(products[0], table.T @ table)
    inverse = np.linalg.inv(covariance)
    exact = table[:12].T @ inverse @ table[:12] + table[12:].T @ table[12:]
    np.testing.assert_allclose(products[1], exact)
    log_det = -0.5 * np.linalg.slogdet(covariance)[1]
    np.testing.assert_allclose(volume, [0.0, log_det], atol=1e-12)


# --- shapes ---


def whitened(error: np.ndarray) -> Whitened:
    """Return what an offset and a slope leave of the error, in noise sds."""
    absorbed = np.column_stack([np.ones(len(error)), RECORDS.deformation])
    return Whitened(error, absorbed, SHAPES)


def test_a_shape_that_the_noise_would_have_to_cancel_is_not_found():
    """Smooth waves resemble a random walk, in which the first steps are all."""
    row, rng = np.arange(150), np.random.default_rng(0)
    x = np.linspace(0.0, 1.0, 150)
    x += 0.15 * np.maximum(0.08 - x, 0.0)
    error = 2.0 * np.sin(18.0 * x) - 5.0 * np.exp(-row / 1.5)
    error += 0.3 * rng.normal(size=150)
    absorbed = np.column_stack([x, np.ones(150)])
    shapes = {"order": (row / 150.0, "", ""), "bend": (x**2, "", "")}
    data = Whitened(error, absorbed, shapes)
    assert not find_structure(data, np.ones(150), Correlated(row - 1, WIDE))
    bent = replace(data, residual=error + 40.0 * x**2)
    found = find_structure(bent, np.ones(150), Correlated(row - 1, WIDE))
    assert [each.name for each in found] == ["bend"]


def shapes_in(error, noise=None) -> list[str]:
    found = find_structure(whitened(error), np.ones(96), noise)
    return [shape.name for shape in found]


@pytest.mark.parametrize("name", SHAPES)
def test_each_shape_is_found_with_its_sign(name):
    sign = 1.0 if len(name) % 2 else -1.0
    column, up, down = SHAPES[name]
    column = (column - column.mean()) / column.std()
    error = np.random.default_rng(1).normal(size=96) + sign * 6.0 * column
    found = find_structure(whitened(error), np.ones(96))[0]
    assert found.name == name and np.sign(found.coefficient) == sign
    assert (up if sign > 0 else down) in found.words


def test_what_the_priors_allow_is_absorbed_and_no_more():
    """A shape along a parameter is found only beyond that parameter's prior."""
    column = np.asarray(RECORDS.sense)
    data = whitened(np.random.default_rng(3).normal(size=96) + column)
    for prior_sd, expected in ((1e-4, True), (1e4, False)):
        absorbed = np.column_stack([data.absorbed, column * prior_sd])
        with_prior = Whitened(
            residual=np.append(data.residual, 0.0),
            absorbed=np.vstack([absorbed, [0.0, 0.0, 1.0]]),
            shapes={n: (np.append(c, 0.0), *w) for n, (c, *w) in SHAPES.items()},
        )
        found = [shape.name for shape in find_structure(with_prior, np.ones(96))]
        assert ("direction" in found) is expected


def alarms(rho: float, noise, count: int, bend: float = 0.0) -> int:
    """Return how often a shape is found; `bend` is its rms in noise sds."""
    basis, column = orthonormal(whitened(np.zeros(96)).absorbed), SHAPES["curvature"][0]
    left = column - basis @ (basis.T @ column)
    rng, shape = np.random.default_rng(11), bend * left / left.std()
    return sum(
        bool(shapes_in(correlated(rho, rng, 96) + shape, noise)) for _ in range(count)
    )


@pytest.mark.parametrize("rho", slice_of([0.0, 0.3, 0.6, 0.8], [0.6]))
def test_noise_raises_few_false_alarms(rho: float):
    assert rarely(alarms(rho, CORRELATED, 400), 400)
    assert rarely(alarms(0.0, None, 400), 400)


@pytest.mark.parametrize(("rho", "bend"), [(0.0, 0.6), (0.0, 3.0), (0.5, 1.2)])
def test_a_bend_is_found_in_correlated_noise(rho: float, bend: float):
    """A large one does not pass for a large correlation."""
    assert alarms(rho, CORRELATED, 60, bend) >= 55


def test_a_known_correlation_is_generalised_least_squares():
    """With dense matrices, runs that alternate included."""
    rng, rho, run = np.random.default_rng(5), 0.6, np.arange(96) % 3
    data = whitened(correlated(rho, rng, 96, run) + 3.0 * np.asarray(RECORDS.sense))
    before = previous_rows(replace(RECORDS, run=run))
    noise = Correlated(before, Prior("fixed", (rho,)))
    found = {shape.name: shape for shape in find_structure(data, np.ones(96), noise)}
    power = np.abs(np.arange(96)[:, None] - np.arange(96)) // 3
    inverse = np.linalg.inv(np.where(run[:, None] == run, rho**power, 0.0))
    design = np.column_stack([data.absorbed, SHAPES["direction"][0]])
    cover = np.linalg.inv(design.T @ inverse @ design)
    fit = cover @ design.T @ inverse @ data.residual
    left = data.residual - design @ fit
    error = np.sqrt(cover[-1, -1] * (left @ inverse @ left) / 93)
    p = 2.0 * stats.t.sf(abs(fit[-1]) / error, 93) * len(SHAPES)
    assert found["direction"].p_value == pytest.approx(p, rel=1e-6)
    assert found["direction"].coefficient == pytest.approx(fit[-1])
    assert found["direction"].error == pytest.approx(error)


def test_smoothing_the_deformation_leaves_no_shape_over_the_rows():
    rng, x = np.random.default_rng(1), np.linspace(0.0, 2.0, 400)
    readings = {
        "displacement_mm": x + rng.normal(0.0, 0.12, 400),
        "force_N": 120.0 * x + rng.normal(0.0, 0.2, 400),
    }
    case = hdcal.read_case(readings)
    assert case.screening is not None
    assert case.screening.deformation_sd == pytest.approx(0.12, rel=0.1)
    assert residuals(hdcal.calibrate(case, warmup=300, draws=100)).structure == ()


# --- noise ---


def faults(error, *, x=X, run=None, absorbed=None, **form) -> list[str]:
    """Return the faults of errors after a line was absorbed."""
    records = make_records(x, **({} if run is None else {"run": run}))
    line = np.column_stack([np.ones(len(x)), x])
    data = Whitened(error, line if absorbed is None else absorbed, {})
    form = {"rounded": False} | form
    found = noise_faults(data, records, np.ones(len(error)), **form)
    return [fault.name for fault in found]


def test_independent_noise_raises_few_false_alarms():
    rng = np.random.default_rng(1)
    assert rarely(sum(bool(faults(rng.normal(size=ROWS))) for _ in range(1000)), 1000)
    # In many short runs with a zero each, too.
    run = np.repeat(np.arange(12), 5)
    absorbed = np.column_stack([run[:, None] == np.arange(12), X])
    found = (
        NEIGHBOURS in faults(rng.normal(size=ROWS), run=run, absorbed=absorbed)
        for _ in range(1000)
    )
    assert rarely(sum(found), 1000, 0.5 * FALSE_ALARM)


@pytest.mark.parametrize("run", [None, np.repeat(np.arange(3), 20)])
def test_correlated_noise_is_found(run):
    rng = np.random.default_rng(3)
    hits = [faults(correlated(0.6, rng, run=run), run=run) for _ in range(100)]
    assert np.mean([NEIGHBOURS in hit for hit in hits]) >= 0.9
    error = correlated(0.9, rng)
    # Nor one run after the other, nor in steps wider than the noise.
    assert NEIGHBOURS not in faults(error, run=np.arange(ROWS))
    assert NEIGHBOURS not in faults(error, rounded=True)


def test_noise_that_grows_is_found_and_correlation_is_no_growth():
    rng, rows = np.random.default_rng(4), 200
    x = np.linspace(0.02, 0.54, rows)

    def share(size, rho: float) -> float:
        found = (
            faults(size * correlated(rho, rng, rows), x=x, correlation=rho)
            for _ in range(200)
        )
        return float(np.mean([SCATTER in each for each in found]))

    # Half of 1 %; of errors as they are it was 9 %.
    assert share(1.0, 0.8) < 0.03
    assert share(1.0 + 2.0 * x / x.max(), 0.8) > 0.9
    assert share(x, 0.0) > 0.95


def test_a_slip_of_writing_is_named_by_its_reading():
    rng = np.random.default_rng(8)
    for rho in (0.0, 0.8):
        error = correlated(rho, rng)
        error[ROWS // 3] += 60.0
        assert WILD in faults(error)
        assert WILD not in faults(error, mixed=True)
        error[ROWS // 3] -= 60.0
        assert WILD not in faults(error)
    # Many of them are no noise either.
    error = correlated(0.0, rng, 400)
    error[25::50] += np.tile([60.0, -60.0], 4)
    assert WILD in faults(error, x=np.linspace(0.02, 0.54, 400))


def test_sizes_are_those_of_all_shapes_together():
    """One odd run of five is two steps: each alone would be a third of its size."""
    run, rng = np.repeat(np.arange(5), 30), np.random.default_rng(2)
    error = 20.0 * (run == 2) + rng.normal(size=len(run))
    steps = {str(k): (1.0 * (run >= k), "", "") for k in range(1, 5)}
    data = Whitened(error, np.ones((len(run), 1)), steps)
    found = {each.name: each for each in find_structure(data, np.ones(len(run)))}
    assert {*found} == {"2", "3"}
    assert found["2"].coefficient == pytest.approx(20.0, abs=1.0)
    assert found["3"].coefficient == pytest.approx(-20.0, abs=1.0)
    assert found["2"].error == pytest.approx(np.sqrt(1 / 60 + 1 / 30), rel=0.2)
