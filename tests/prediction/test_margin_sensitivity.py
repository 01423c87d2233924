"""What a margin hangs on: exact gradients, and shares that know the answer."""

from dataclasses import replace

import jax
import numpy as np
import pytest
from posteriors import (
    batch,
    compensated,
    plain_draws,
    ramp_case,
    single,
    stiffer,
    written_posterior,
)
from rigs import make_gear

import hdcal
from hdcal.prediction.engine.causes import causes_of
from hdcal.prediction.engine.mixture import Mixture, weighted_quantile
from hdcal.prediction.engine.population_force import population_force
from hdcal.prediction.margin.gradients import Redesign, gradients
from hdcal.prediction.margin.request import Criteria
from hdcal.prediction.margin.variance_shares import sobol_indices, variance_shares

WARM, CRITERIA = 40.0, Criteria(0.99, 0.95, None, None)
QUANTILE = jax.jit(Mixture.quantile)


def bound(mixture: Mixture) -> float:
    """Compute the upper bound from scratch."""
    found = np.asarray(QUANTILE(mixture, CRITERIA.content))
    return weighted_quantile(found, np.ones(len(found)), CRITERIA.confidence)


def check(posterior, population: str, tolerances: dict) -> None:
    (cause,) = causes_of(posterior)
    force = population_force(cause, 0.4, population, tolerances=tolerances).at(WARM)
    quantiles = np.asarray(QUANTILE(force.mixture(), CRITERIA.content))
    found = gradients([force], quantiles, CRITERIA)
    at = {slope.name: slope.value for slope in found}
    assert at["K"] == pytest.approx(np.median(cause.values["K"]), rel=1e-3)
    gear = Redesign.of(force, {name: at[name] for name in ("E0_GPa", "K")})
    assert {slope.name for slope in found} == set(gear.origin)
    for slope in found:
        step = 1e-5 * slope.value
        ends = [
            bound(gear.mixture({**gear.origin, slope.name: slope.value + by}))
            for by in (step, -step)
        ]
        difference = (ends[0] - ends[1]) / (2.0 * step)
        assert slope.bound_N == pytest.approx(difference, rel=1e-6), slope.name
        per_cent = slope.bound_N * slope.value / 100.0
        assert slope.bound_N_per_percent == pytest.approx(per_cent)


def test_gradients_of_one_rounded_gear_agree_with_differences():
    check(single(make_gear(resolution=0.98), 300), "readings", {})


@pytest.mark.thorough
def test_gradients_of_a_cup_with_tolerances_agree_with_differences():
    sizes = {"wall_thickness": 0.02, "load_height": 2.0}
    check(single(make_gear(theory="cup"), 200), "readings", sizes)


@pytest.mark.slow
def test_gradients_of_many_gears_through_a_bent_force_agree_with_differences():
    gears = batch(6, 200)
    draws = {**gears.draws, "force_saturation.curvature": np.full(200, 2e-5)}
    bent = written_posterior(gears.case, draws, effects=["force_saturation"])
    check(bent, "specimens", {"radius": 0.05})


def test_the_ring_has_the_exponents_of_its_formula():
    found = hdcal.margin(single(size=300), 0.4)
    by_name = {slope.name: slope for slope in found.gradients}
    percent = {n: s.force_N * s.value for n, s in by_name.items()}
    load = percent["K"]
    for name, power in (("wall_thickness_mm", 3), ("radius_mm", -3), ("length_mm", 1)):
        assert percent[name] == pytest.approx(power * load, rel=1e-9)
    assert percent["E0_GPa"] == pytest.approx(load, rel=1e-9)
    assert "load_height_mm" not in by_name


def test_modulus_and_coefficient_scale_alike_whatever_the_causes():
    """Causes may differ in K, of which one per cent is another size in each."""
    one = single(size=300)
    found = hdcal.margin([(0.7, one), (0.3, stiffer(one, 1.5))], 0.4)
    by_name = {slope.name: slope for slope in found.gradients}
    modulus, factor = by_name["E0_GPa"], by_name["K"]
    assert factor.bound_N_per_percent == pytest.approx(modulus.bound_N_per_percent)
    load = modulus.force_N * modulus.value
    assert factor.force_N * factor.value == pytest.approx(load)


def test_shares_of_a_sum_are_its_variances():
    """All inputs add up here, so that the shares are known."""
    case = ramp_case(compensated())
    draws = plain_draws(case, 2000) | {
        "sigma": np.full(2000, 0.8),
        "deformation_offset": np.zeros(2000),
    }
    posterior = written_posterior(case, draws)
    force = population_force(*causes_of(posterior), 0.4, "readings").at(60.0)
    found = {s.name: s for s in variance_shares([force])}
    at = 0.4 * draws["stiffness"] * (1.0 - 3e-4 * 40.0) + draws["force_offset"]
    parts = {
        "calibration": np.var(at),
        "noise": 0.64,
        "alpha": np.var(0.4 * 205.0 * 40.0 * draws["alpha"]),
    }
    check_shares(found, parts)
    assert {s.name: s.driven_by for s in found.values()} == {
        "calibration": "data",
        "alpha": "prior",
        "noise": "data",
    }
    # On a rig that drifts by 0.1 N and a micrometre per kelvin, 40 K away.
    case = replace(case, gear=make_gear())
    force = population_force(*causes_of(replace(posterior, case=case)), 0.4, "readings")
    found = {s.name: s for s in variance_shares([force.at(60.0)])}
    drifts = {"zero_drift": 0.1, "frame": 1e-3 * 205.0 * (1.0 - 3e-4 * 40.0)}
    check_shares(found, parts | {n: (40.0 * sd) ** 2 for n, sd in drifts.items()})
    assert {found[name].driven_by for name in drifts} == {"prior"}


def check_shares(found, parts):
    """Require shares to be those of independent parts of a variance."""
    total = sum(parts.values())
    for name, part in parts.items():
        assert found[name].first == pytest.approx(part / total, abs=0.02)
        assert found[name].total == pytest.approx(part / total, abs=0.02)


@pytest.mark.thorough
def test_every_source_has_its_share():
    gears = batch(6, 400)
    asked = {"tolerances": {"wall_thickness_mm": 0.02}, "temperature": 60.0}
    models = [(0.6, gears), (0.4, stiffer(gears, 1.05))]
    found = hdcal.margin(models, 0.6, **asked).shares
    names = {"calibration", "cause", "alpha", "noise", "mounting", "gear"}
    untested = {"leftover", "zero_drift", "frame"}
    assert {s.name for s in found} == names | untested | {"wall_thickness"}
    assert {s.driven_by for s in found if s.name == "wall_thickness"} == {"given"}
    assert sum(share.first for share in found) < 1.05
    assert sum(share.total for share in found) > 0.95
    assert all(share.total > share.first - 0.05 for share in found)
    # Gears differ by 5 %, their walls by 5 % too: both matter, the noise does not.
    large = {s.name for s in found if s.total > 0.1}
    assert {"gear", "wall_thickness"} <= large and "noise" not in large


@pytest.mark.thorough
def test_a_drift_that_one_cause_holds_is_open_for_the_others():
    """Whichever of them comes first."""
    plain = single(size=400)
    sizes = {"thermal_zero_drift.slope": np.full(400, 0.1)}
    known = {"temperature"}
    draws = plain_draws(ramp_case(known=known), 400) | sizes
    held = written_posterior(
        ramp_case(known=known), draws, effects=["thermal_zero_drift"]
    )
    for models in ([(0.6, held), (0.4, plain)], [(0.4, plain), (0.6, held)]):
        found = hdcal.margin(models, 0.4, temperature=60.0).shares
        assert "zero_drift" in {share.name for share in found}


def test_a_single_source_has_all_of_it():
    """At the reference temperature the load hangs on the calibration alone."""
    (only,) = hdcal.margin(single(size=400), 0.4, quantity="load").shares
    assert (only.name, only.first, only.total) == ("calibration", 1.0, 1.0)


def test_indices_are_those_of_ishigamis_function():
    """Known in closed form; its third input acts through the first one only."""

    def ishigami(points: np.ndarray) -> np.ndarray:
        x, y, z = np.pi * (2.0 * points.T - 1.0)
        return np.sin(x) + 7.0 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)

    a, b = 7.0, 0.1
    alone = 0.5 * (1.0 + b * np.pi**4 / 5.0) ** 2, a**2 / 8.0, 0.0
    both = 8.0 * b**2 * np.pi**8 / 225.0
    total = np.array([alone[0] + both, alone[1], both])
    whole = sum(alone) + both
    # The error of one set of points is 0.0045 rms, that of the mean of eight 0.0016.
    found = [sobol_indices(ishigami, 3, 4096, seed) for seed in range(8)]
    first, every = np.mean(found, axis=0)
    np.testing.assert_allclose(first, np.array(alone) / whole, atol=0.0064)
    np.testing.assert_allclose(every, total / whole, atol=0.0064)
