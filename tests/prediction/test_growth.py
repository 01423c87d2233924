"""Beyond the tested deformation: the bend, by a slow twin and by the truth."""

import jax
import numpy as np
import pytest
from benchmarks.blind.rig.mechanisms import MECHANISMS
from posteriors import regressed, single, with_leftover
from pulled_further import OF_TIME, all_pulled_further
from slices import slice_of

import hdcal
from hdcal.prediction.engine.causes import causes_of
from hdcal.prediction.engine.growth import Growth, bend_covariance, fit_growths
from hdcal.prediction.margin.margin import Margin

QUICK = {"sensitivities": False}


@jax.jit
def law(growth: Growth, places, size, noise):
    """Return mean and sd of a bend of a size."""
    return growth.of_size(size, noise).at(places)[:2]


def covariance(one, other):
    """Integrate both Wiener processes numerically."""
    start = np.linspace(0.0, 2.0, 4001)
    left = np.clip(one[:, None, None] - start, 0.0, None)
    right = np.clip(other[None, :, None] - start, 0.0, None)
    return np.trapezoid(left * right + (left * right) ** 2 / 4.0, start, axis=-1)


@pytest.mark.parametrize("turned", [False, True])
def test_the_bend_is_that_of_a_dense_process(turned: bool):
    """A process beside a line of which nothing is known, less the line alone."""
    x, rng = np.linspace(0.02, 0.52, 20), np.random.default_rng(3)
    left = rng.normal(0.0, 0.5, 20) + 3.0 * (x / 0.52) ** 3
    (cause,) = causes_of(regressed(x, 200.0 * x + left, rng))
    ends = (0.02, 0.52) if turned else (0.52, 0.02)
    below, above = fit_growths(cause)
    growth = (below if turned else above).growth
    asked = np.array([0.52, 0.6, 0.9]) if not turned else np.array([0.02, -0.1, -0.4])
    mean, sd = law(growth, asked, 7.0, 0.6)

    place, new = ((at - ends[1]) / (ends[0] - ends[1]) for at in (x, asked))
    lines, over = (np.stack([np.ones_like(t), t], axis=1) for t in (place, new))
    known = 49.0 * covariance(place, place) + 0.36 * np.eye(20) + 1e5 * lines @ lines.T
    cross = 49.0 * covariance(new, place) + 1e5 * over @ lines.T
    own = 49.0 * covariance(new, new) + 1e5 * over @ over.T
    off = np.linalg.lstsq(lines, left, rcond=None)[0]
    expected = cross @ np.linalg.solve(known, left) - over @ off
    spread = own - cross @ np.linalg.solve(known, cross.T)
    spread = spread - 0.36 * over @ np.linalg.solve(lines.T @ lines, over.T)
    np.testing.assert_allclose(mean, expected, rtol=5e-3, atol=5e-3)
    np.testing.assert_allclose(np.asarray(sd) ** 2, np.diag(spread), rtol=2e-2)

    powers = new[:, None] ** np.arange(3)
    taken = np.asarray(growth.given(7.0, 0.6)[1])
    taken = powers @ (0.5 * (taken + taken.T)) @ powers.T
    together = 49.0 * (bend_covariance(new, new) - taken)
    np.testing.assert_allclose(together[1:, 1:], spread[1:, 1:], rtol=2e-2)


def test_it_has_no_part_in_what_was_tested_and_begins_without_a_step():
    posterior = single()
    inside, edge, beyond = (
        hdcal.margin(posterior, at, **QUICK).worst.force_N
        for at in (0.54 - 1e-6, 0.54, 0.54 + 1e-6)
    )
    for end in ("lo", "median", "hi"):
        assert getattr(inside, end) == pytest.approx(getattr(edge, end), rel=1e-5)
        assert getattr(beyond, end) == pytest.approx(getattr(edge, end), rel=1e-5)


@pytest.mark.parametrize("make", slice_of([single, with_leftover], [with_leftover]))
def test_bands_and_margin_say_the_same(make):
    """In the mean of some seeds: one moves an end by three percent of the width."""
    posterior = make()
    for at in (0.6, 0.8):
        bands, found = [], []
        for seed in range(6):
            whole = hdcal.predict(posterior, [at], seed=seed)
            kind = "physics" if np.isnan(whole.with_gap_lo_N[0]) else "with_gap"
            ends = [f"{kind}_{end}_N" for end in ("lo", "median", "hi")]
            bands.append([getattr(whole, end)[0] for end in ends])
            force = hdcal.margin(posterior, at, seed=seed, **QUICK).worst.force_N
            found.append([force.lo, force.median, force.hi])
        low, _, high = np.mean(found, axis=0)
        expected = pytest.approx(np.mean(found, axis=0), abs=0.03 * (high - low))
        assert np.mean(bands, axis=0) == expected


@pytest.mark.thorough
def test_an_outlier_is_no_bend():
    """A cause that knows of outliers does not take one for curvature."""
    x, rng = np.linspace(0.02, 0.54, 40), np.random.default_rng(5)
    force = 200.0 * x + rng.normal(0.0, 0.3, 40)
    force[-2] += 12.0
    posterior = regressed(x, force, rng)
    known = {"outliers__fraction": 0.05, "outliers__ratio": 20.0, "sigma": 0.3}
    knows = regressed(x, force, rng, effects=["outliers"], **known)
    bent, straight = (
        np.ptp([getattr(hdcal.margin(p, 0.9, **QUICK).worst.force_N, e) for e in ENDS])
        for p in (posterior, knows)
    )
    assert straight < 0.5 * bent


@pytest.mark.parametrize("noise", [0.0, 1e-200])
def test_readings_without_noise_have_hardly_a_bend(noise: float):
    x, rng = np.linspace(0.02, 0.54, 20), np.random.default_rng(8)
    posterior = regressed(x, 200.0 * x, rng, 200, sigma=noise)
    found = hdcal.predict(posterior, [0.9])
    assert found.physics_lo_N[0] == pytest.approx(180.0, abs=0.5)
    assert found.physics_hi_N[0] == pytest.approx(180.0, abs=0.5)


ENDS = ("lo", "hi")


def inside(found: Margin, truth: float) -> bool:
    """Tell whether the 95 % interval of the mean reading holds the truth."""
    return found.worst.force_N.lo <= truth <= found.worst.force_N.hi


def held(names, times: float, count: int, seed: int) -> tuple[float, float, int]:
    """Return in which share intervals hold the truth: margin's, the line's alone."""
    rng, right, alone, cases = np.random.default_rng(seed), 0, 0, 0
    for case in all_pulled_further(names, times, count, seed):
        posterior = regressed(case.deformation, case.force, rng)
        right += inside(hdcal.margin(posterior, case.at, **QUICK), case.truth)
        draws = posterior.draws
        line = draws["stiffness"] * case.at + draws["force_offset"]
        low, high = np.quantile(line, [0.025, 0.975])
        alone += int(low <= case.truth <= high)
        cases += 1
    return right / cases, alone / cases, cases


OF_SHAPE = ("progressive_stiffening", "contact_bedding", "seating_slack", "hysteresis")


@pytest.mark.parametrize("times", slice_of([1.5, 2.0], [2.0]))
def test_a_slice_of_mechanisms_stays_inside(times: float):
    right, alone, cases = held(OF_SHAPE, times, 4, seed=11)
    assert cases >= 15
    # 90 % are promised. The line alone, which was the answer before, must fail.
    assert right >= 0.8 and alone <= 0.5, (right, alone)


@pytest.mark.slow
@pytest.mark.parametrize("times", [1.5, 2.0])
def test_every_mechanism_stays_inside(times: float):
    names = [name for name in MECHANISMS if name not in OF_TIME]
    right, alone, cases = held(names, times, 25, seed=12)
    assert cases >= 200
    assert right >= 0.9 and alone <= 0.5, (right, alone, cases)
