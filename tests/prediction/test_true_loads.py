"""A load is true of the gear: certificates widen it, and not the rig's next reading."""

from dataclasses import replace

import numpy as np
import pytest
from benchmarks import certificates
from benchmarks.certificates import TOLD, TOUCHED, WRONG, coverage
from gauged import SDS, certified, told
from posteriors import plain_draws, ramp_case, written_posterior
from rigs import make_gear
from scipy import stats

import hdcal
from hdcal.prediction.conditions import Conditions
from hdcal.prediction.joint import joint
from hdcal.prediction.simulate import simulate

AT, SIZE = 0.4, 1000
COARSE = "expanded_percent = 10.0"


def drawn_gauges() -> dict:
    rng = np.random.default_rng(3)
    return {name: rng.normal(0.0, sd, SIZE) for name, sd in SDS.items()}


def pair(effects=(), with_gap=False, **others):
    """Return posteriors that read the same, without and with certificates."""
    found = []
    for gear, gauges in ((make_gear(), {}), (certified(), drawn_gauges())):
        case = ramp_case(gear)
        draws = told({**plain_draws(case, SIZE), **others}, **gauges)
        found.append(written_posterior(case, draws, effects=effects, with_gap=with_gap))
    return found


def gap() -> dict:
    weights = np.random.default_rng(2).normal(0.0, 0.5, (SIZE, 20))
    weights = weights / (1.0 + np.arange(20.0)) ** 2
    scales = {"gap_sd": np.full(SIZE, 1.5), "gap_length": np.full(SIZE, 0.3)}
    return scales | {"gap_weights": weights}


KINDS = {
    "plain": {},
    "gap": {"with_gap": True, **gap()},
    "stiffening": {
        "effects": ("progressive_stiffening",),
        "progressive_stiffening.slope": np.full(SIZE, 0.3),
    },
}


def centre(posterior, quantity: str, at=AT, warm=20.0) -> np.ndarray:
    """Return the mean force of each draw without the bend."""
    found = simulate(joint(posterior), Conditions.of(at, warm, quantity=quantity))
    return (found.centre - found.common["bend"])[:, 0]


@pytest.mark.parametrize("kind", KINDS)
def test_the_next_reading_is_the_same(kind: str):
    plain, stated = pair(**KINDS[kind])
    for warm in (20.0, 60.0):
        expected = centre(plain, "reading", warm=warm)
        found = centre(stated, "reading", warm=warm)
        np.testing.assert_allclose(found, expected, rtol=1e-12)
    bands = [hdcal.predict(one, [0.1, AT], [20.0, 50.0]) for one in (plain, stated)]
    for name in ("physics_lo_N", "new_measurement_hi_N"):
        columns = [getattr(one, name) for one in bands]
        # The residuals are those of the mean parameters, which are not linear.
        np.testing.assert_allclose(columns[1], columns[0], rtol=1e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_a_load_is_that_where_the_gauges_show_it_less_the_gain(kind: str):
    """Draw by draw: from the load as read at what the gauges of that draw show."""
    plain, stated = pair(**KINDS[kind])
    load, gauges = centre(stated, "load"), drawn_gauges()
    for one in range(0, SIZE, 250):
        gain, stretch, offset = (gauges[name][one] for name in SDS)
        there = centre(plain, "load", (1.0 + stretch) * AT, 20.0 + offset)[one]
        assert load[one] == pytest.approx(there / (1.0 + gain), rel=1e-12)


def test_the_load_widens_by_the_root_sum_of_squares():
    plain, stated = pair(deformation_offset=np.zeros(SIZE))
    before, after = (np.log(centre(one, "load")).std() for one in (plain, stated))
    gains = SDS["force_gain"], SDS["deformation_gain"]
    warm = 3e-4 * SDS["temperature_offset"]
    assert after == pytest.approx(np.linalg.norm([before, *gains, warm]), rel=0.05)


def test_a_gear_is_as_stiff_as_it_is():
    """At the reference, a true one, nothing but the stiffness counts."""
    _, stated = pair(deformation_offset=np.full(SIZE, 0.01))
    for at in (0.2, AT):
        expected = at * stated.draws["stiffness"]
        np.testing.assert_allclose(centre(stated, "gear", at), expected, rtol=1e-12)


# --- simulated rigs: what an interval of 95 % holds ---


def shortfall(hits: np.ndarray, share: float = 0.95) -> float:
    """Return the probability of so few hits, or fewer."""
    return float(stats.binom.cdf(np.sum(hits), len(hits), share))


@pytest.mark.thorough
def test_a_slice_of_coverage(monkeypatch):
    held = coverage(TOLD, range(12))[:, :3]
    assert min(map(shortfall, held.T)) > 1e-3
    # A displacement gauge's certificate does not state where the contact was.
    load, _, reading = coverage(TOUCHED, range(8))[:, :3].T
    assert shortfall(load) < 1e-3 < shortfall(reading)
    # A few rigs flag gains that are ignored, if coarse, and no reading shows them.
    coarse = certificates.STATED.replace("expanded_percent = 1.0", COARSE)
    assert coarse != certificates.STATED
    gear = certificates.gear_of(certificates.SIZES + coarse)
    contenders = {TOLD: gear, WRONG: replace(gear, gauge_priors={})}
    monkeypatch.setattr(certificates, "gears", lambda: contenders)
    load, stiffness, reading = coverage(WRONG, range(12))[:, :3].T
    assert max(shortfall(load), shortfall(stiffness)) < 1e-3 < shortfall(reading)
