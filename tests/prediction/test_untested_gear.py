"""Gears beyond the tested deformation: the truth inside, and what may not change."""

from dataclasses import replace

import numpy as np
import pytest
from posteriors import regressed, single, with_leftover, written_posterior
from pulled_further import all_pulled_further
from slices import slice_of

import hdcal
from hdcal.design.gears import Gears, draw_gears
from hdcal.design.study import force_quantiles
from hdcal.inference.model_average import ModelAverage
from hdcal.inference.posterior import Posterior

SHARES = np.array([0.5, 0.025, 0.975])


def spans(draws: Gears, at) -> np.ndarray:
    """Return median and ends of the force on the tested gear, (3, n)."""
    at = np.atleast_1d(np.asarray(at, float))
    return force_quantiles(draws, at, np.full(len(at), 20.0), np.ones(len(at)), SHARES)


def straight(draws: Gears) -> Gears:
    """Return draws whose model goes on holding, as it was answered before."""
    return replace(draws, model=replace(draws.model, untested=None))


def held(times: float, count: int, seed: int) -> tuple[float, float, int]:
    """Return in which share bands hold the truth: with the bend, without it."""
    rng, right, alone, cases = np.random.default_rng(seed), 0, 0, 0
    for case in all_pulled_further(["progressive_stiffening"], times, count, seed):
        draws = draw_gears(regressed(case.deformation, case.force, rng))
        truth = case.truth - case.zero
        for model in (draws, straight(draws)):
            _, low, high = spans(model, case.at)[:, 0]
            inside = int(low <= truth <= high)
            right, alone = (
                (right + inside, alone) if model is draws else (right, alone + inside)
            )
        cases += 1
    return right / cases, alone / cases, cases


@pytest.mark.parametrize("times", slice_of([1.5, 2.0], [2.0]))
def test_a_slice_of_stiffening_gears_stays_inside(times: float):
    right, alone, cases = held(times, 6, seed=21)
    assert cases >= 10
    assert right >= 0.9 and alone < 0.6, (right, alone)


@pytest.mark.slow
@pytest.mark.parametrize("times", [1.5, 2.0])
def test_stiffening_gears_stay_inside(times: float):
    right, alone, cases = held(times, 100, seed=22)
    assert cases >= 150
    assert right >= 0.9 and alone < 0.6, (right, alone, cases)


@pytest.mark.parametrize("make", [single, with_leftover])
def test_nothing_grows_between_rest_and_the_tested_ends(make):
    draws = draw_gears(make())
    low, high = (np.ptp(spans(draws, [0.3, 0.8])[1:], axis=0)).tolist()
    assert high / 0.8 > 1.1 * low / 0.3
    if make is single:
        tested = [0.005, 0.02, 0.3, 0.53]
        np.testing.assert_array_equal(
            spans(draws, tested), spans(straight(draws), tested)
        )
    # Rest is known, on the way to the other sense of loading too.
    near = spans(straight(draw_gears(single())), [-1e-6])
    np.testing.assert_allclose(spans(draw_gears(single()), [-1e-6]), near, atol=1e-3)


def test_a_product_has_no_rig_that_drifts():
    draws = draw_gears(single())
    warm = np.full(1, 80.0)
    asked = np.full(1, 0.4), warm, np.ones(1), SHARES
    np.testing.assert_array_equal(
        force_quantiles(draws, *asked), force_quantiles(straight(draws), *asked)
    )


# A narrow range shows the slope there and no curvature, and the zero of the gauge is
# not known: a gear that stiffens and one that does not fit such rows alike.
STIFFENING, MIDDLE = "progressive_stiffening", 0.33


def narrow(rng: np.random.Generator) -> tuple[Posterior, Posterior, float]:
    """Return both models of a narrow range, and the force on the gear in truth [N]."""
    deformation, draws = np.linspace(0.3, 0.36, 20), 800
    gain = rng.normal(0.35, 0.1) * rng.integers(2)
    stiffness = 200.0 * (1.0 + 0.02 * rng.normal())
    own = stiffness * deformation * (1.0 + gain * deformation)
    force = own + rng.normal() + rng.normal(0.0, 0.1, 20)
    plain = regressed(deformation, force, rng, draws)
    gains, found = rng.normal(0.35, 0.1, draws), plain.draws
    bent = 1.0 / (1.0 + 2.0 * MIDDLE * gains)
    shift = 1.0 - bent * (1.0 + gains * MIDDLE)
    split = {name: found[name] * bent for name in ("K", "stiffness")}
    zero = found["force_offset"] + found["stiffness"] * MIDDLE * shift
    split |= {"force_offset": zero, f"{STIFFENING}.slope": gains}
    curved = written_posterior(plain.case, {**found, **split}, effects=[STIFFENING])
    return plain, curved, stiffness * MIDDLE * (1.0 + gain * MIDDLE)


def of_study(posterior: Posterior) -> tuple[float, float]:
    _, low, high = spans(draw_gears(posterior), MIDDLE)[:, 0]
    return low, high


def of_margin(posterior: Posterior) -> tuple[float, float]:
    asked = {"quantity": "load", "sensitivities": False}
    found = hdcal.margin(posterior, MIDDLE, **asked).worst.force_N
    return found.lo, found.hi


def kept(answer, cases: int, seed: int) -> tuple[float, float]:
    """Return in which share intervals hold the truth: the mixture's, the name's."""
    rng, found = np.random.default_rng(seed), []
    for _ in range(cases):
        plain, curved, truth = narrow(rng)
        models = {"none": (0.5, plain), STIFFENING: (0.5, curved)}
        ends = answer(ModelAverage(models)), answer(plain)
        found.append([low <= truth <= high for low, high in ends])
    mixture, name = np.mean(found, axis=0)
    return mixture, name


@pytest.mark.thorough
def test_a_mixture_holds_what_the_single_name_does_not():
    mixture, name = kept(of_study, 24, seed=31)
    assert mixture >= 0.8 and name <= 0.75, (mixture, name)


@pytest.mark.slow
@pytest.mark.parametrize("answer", [of_study, of_margin])
def test_a_mixture_holds_the_truth_in_two_hundred_cases(answer):
    mixture, name = kept(answer, 200, seed=32)
    assert mixture >= 0.93 and name <= 0.6, (mixture, name)
