"""The bend that readings leave possible: closed forms, continuity and edge cases."""

import numpy as np
import pytest
from posteriors import ramp_case, regressed, single, with_discrepancy, written_posterior
from slices import slice_of

import hdcal
from hdcal.prediction.extrapolation import FADE, SIZES, fit_bends

ENDS = ("lo", "median", "hi")


def integrated(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the covariance of both Wiener processes by numerical integration."""
    start = np.linspace(0.0, 2.0, 4001)
    left = np.clip(one[:, None, None] - start, 0.0, None)
    right = np.clip(other[None, :, None] - start, 0.0, None)
    return np.trapezoid(left * right + (left * right) ** 2 / 4.0, start, axis=-1)


def curved(seed: int = 3, rows: int = 20):
    """Return rows of a curve, and the posterior of the straight model."""
    x, rng = np.linspace(0.02, 0.52, rows), np.random.default_rng(seed)
    left = rng.normal(0.0, 0.5, rows) + 3.0 * (x / 0.52) ** 3
    return x, left, regressed(x, 200.0 * x + left, rng)


@pytest.mark.parametrize("side", [0, 1])
def test_the_bend_is_that_of_a_dense_process(side: int):
    """A Gaussian process with a free line, from which the fitted line is taken off."""
    x, left, posterior = curved()
    bend = fit_bends(posterior)[side]
    assert (bend.far, bend.end) == ((0.52, 0.02), (0.02, 0.52))[side]
    asked = np.array([[0.3, 0.02, -0.1, -0.4], [0.25, 0.52, 0.6, 0.9]][side])
    mean, sd = bend.law(asked)

    place, new = ((at - bend.far) / (bend.end - bend.far) for at in (x, asked))
    lines, over = (np.stack([np.ones_like(t), t], axis=1) for t in (place, new))
    off = np.linalg.lstsq(lines, left, rcond=None)[0]
    for law in (20, 75, 110):
        size = bend.size[law]
        # Laws of one noise stand side by side: they differ by their size alone.
        first = len(SIZES) * (law // len(SIZES))
        sizes, spread = bend.size[first : first + 2] ** 2, bend.variance[0, first:]
        strength = (spread[1] - spread[0]) / (sizes[1] - sizes[0])
        noise = np.sqrt(spread[0] - strength * sizes[0])
        square, free = size**2, 1e5 * size**2
        known = square * integrated(place, place) + noise**2 * np.eye(20)
        known += free * lines @ lines.T
        cross = square * integrated(new, place) + free * over @ lines.T
        own = square * integrated(new, new) + free * over @ over.T
        expected = cross @ np.linalg.solve(known, left) - over @ off
        spread = own - cross @ np.linalg.solve(known, cross.T)
        spread -= noise**2 * over @ np.linalg.solve(lines.T @ lines, over.T)
        np.testing.assert_allclose(mean[law], expected, rtol=1e-2, atol=2e-2)
        np.testing.assert_allclose(sd[law] ** 2, np.diag(spread), rtol=3e-2, atol=1e-3)


def test_laws_have_the_probability_of_the_residuals():
    """Curved residuals make a larger bend probable than straight ones."""
    x, rng = np.linspace(0.02, 0.54, 40), np.random.default_rng(1)
    means = []
    for curve in (0.0, 20.0):
        force = 200.0 * x + curve * x**2 + rng.normal(0.0, 0.3, 40)
        bend = fit_bends(regressed(x, force, rng))[1]
        assert bend.chances.sum() == pytest.approx(1.0)
        means.append(float(bend.chances @ bend.size))
        assert {*np.round(bend.size / bend.size.min(), 6)} == {
            *np.round(SIZES / SIZES.min(), 6)
        }
    assert means[1] > 3.0 * means[0]


@pytest.mark.parametrize(
    "make", slice_of([single, with_discrepancy], [with_discrepancy])
)
@pytest.mark.parametrize("at", [0.02, 0.28, 0.54])
def test_there_is_no_step_at_the_ends_or_in_the_middle(make, at: float):
    places = at + np.array([-1e-6, 0.0, 1e-6])
    found = hdcal.predict(make(size=400), places)
    for end in ENDS:
        force = getattr(found, f"physics_{end}_N") - 205.0 * places
        assert np.ptp(force) < 1e-3


def width(posterior, at: float) -> float:
    found = hdcal.margin(posterior, at).worst.force_N
    return found.hi - found.lo


def test_readings_without_noise_have_hardly_a_bend():
    x, rng = np.linspace(0.02, 0.54, 20), np.random.default_rng(8)
    posterior = regressed(x, 200.0 * x, rng, 200, sigma=0.0)
    found = hdcal.predict(posterior, [0.3, 0.9])
    np.testing.assert_allclose(found.physics_lo_N, [60.0, 180.0], atol=0.5)
    np.testing.assert_allclose(found.physics_hi_N, [60.0, 180.0], atol=0.5)


def test_an_outlier_is_no_bend():
    """A model with outliers does not take one for curvature."""
    x, rng = np.linspace(0.02, 0.54, 40), np.random.default_rng(5)
    force = 200.0 * x + rng.normal(0.0, 0.3, 40)
    force[-2] += 12.0
    known = {"outliers__fraction": 0.05, "outliers__ratio": 20.0, "sigma": 0.3}
    bent = width(regressed(x, force, rng), 0.9)
    straight = width(regressed(x, force, rng, effects=["outliers"], **known), 0.9)
    assert straight < 0.5 * bent


def test_beyond_the_end_the_bend_replaces_a_fitted_discrepancy():
    """Far beyond the end it has no part; within the range it alone has one."""
    posterior = with_discrepancy(400)
    shift = 10.0 / (1.0 + np.arange(20.0)) ** 2
    moved = {"gap_weights": posterior.draws["gap_weights"] + shift}
    other = written_posterior(ramp_case(), {**posterior.draws, **moved}, with_gap=True)
    places = np.array([0.3, 0.54, 0.547, 0.54 + 3.0 * FADE * 0.52])
    one, two = (hdcal.predict(p, places).with_gap_median_N for p in (posterior, other))
    inside, end, just, far = np.abs(two - one)
    assert min(inside, end) > 0.1 and 0.3 * end < just < end
    assert far < 1e-3 * end


def test_each_draw_has_a_law_by_its_probability():
    bend, at = fit_bends(curved()[2])[1], np.array([0.3, 0.6, 0.8])
    levels = (np.arange(100_000) + 0.5) / 100_000
    drawn = bend.of_draws(at, levels)
    for found, law in zip(drawn, bend.law(at), strict=True):
        np.testing.assert_allclose(found.mean(axis=0), bend.chances @ law, rtol=1e-3)
    law = int(np.searchsorted(np.cumsum(bend.chances), 0.5))
    np.testing.assert_allclose(drawn[1][50_000], bend.law(at)[1][law])


def test_a_loop_in_the_discrepancy_goes_on_beyond_the_tested_range():
    """Friction of 1.5 N, of which the model knows nothing."""
    x = np.concatenate([np.linspace(0.04, 0.5, 40), np.linspace(0.5, 0.04, 40)])
    sense, rng = np.repeat([1.0, -1.0], 40), np.random.default_rng(7)
    force = 210.0 * x + 1.5 * sense + rng.normal(0.0, 0.3, 80)
    case = hdcal.read_case({"deformation_mm": x, "force_N": force}, range="all")
    posterior = hdcal.calibrate(case, with_gap=True, warmup=300, draws=500)
    assert posterior.usable
    at = np.array([0.3, 0.49, 0.52, 0.6])
    up, down = (hdcal.predict(posterior, at, direction=way) for way in ("up", "down"))
    width = up.with_gap_median_N - down.with_gap_median_N
    assert width == pytest.approx(np.full(4, 3.0), abs=0.4)
    assert width[2:] == pytest.approx(width[1] * np.ones(2), abs=0.1)
