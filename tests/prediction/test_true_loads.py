"""A load is true of the gear: certificates widen it, and not the rig's next reading."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from benchmarks import certificates
from benchmarks.certificates import SILENT, TOLD, TOUCHED, WRONG, coverage
from gauged import SDS, certified, told
from posteriors import plain_draws, ramp_case, written_posterior
from rigs import make_gear
from scipy import stats
from slices import slice_of

import hdcal
from hdcal.data.gear_file.certificates import GAINS
from hdcal.prediction.engine.causes import causes_of
from hdcal.prediction.engine.forces import force_of, grid_records
from hdcal.prediction.engine.gear_forces import gear_forces
from hdcal.prediction.engine.population_force import population_force
from hdcal.tracking import draw_forces

AT, SIZE = 0.4, 2000
COARSE = "expanded_percent = 10.0"


def draws_of(case, gauges: dict, **others) -> dict:
    return told({**plain_draws(case, SIZE), **others}, **gauges)


def drawn_gauges() -> dict:
    rng = np.random.default_rng(3)
    return {name: rng.normal(0.0, sd, SIZE) for name, sd in SDS.items()}


def pair(effects=(), with_gap=False, **others):
    """Return posteriors that read the same, without and with certificates."""
    plain, stated = ramp_case(make_gear()), ramp_case(certified())
    about = {"effects": effects, "with_gap": with_gap}
    return (
        written_posterior(plain, draws_of(plain, {}, **others), **about),
        written_posterior(stated, draws_of(stated, drawn_gauges(), **others), **about),
    )


def gap() -> dict:
    rng = np.random.default_rng(2)
    weights = rng.normal(0.0, 0.5, (SIZE, 20)) / (1.0 + np.arange(20.0)) ** 2
    return {
        "gap_sd": np.full(SIZE, 1.5),
        "gap_length": np.full(SIZE, 0.3),
        "gap_weights": weights,
    }


KINDS = {
    "plain": {},
    "gap": {"with_gap": True, **gap()},
    "stiffening": {
        "effects": ("progressive_stiffening",),
        "progressive_stiffening.slope": np.full(SIZE, 0.3),
    },
}


def centre(posterior, quantity: str, deformation=AT, temperature=20.0):
    (cause,) = causes_of(posterior)
    found = population_force(cause, deformation, "readings", quantity=quantity)
    return np.asarray(found.at(temperature).mixture().centre())


@pytest.mark.parametrize("kind", slice_of(KINDS, ["gap"]))
def test_the_next_reading_is_the_same(kind: str):
    plain, stated = pair(**KINDS[kind])
    for warm in (20.0, 60.0):
        expected = centre(plain, "reading", temperature=warm)
        found = centre(stated, "reading", temperature=warm)
        np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize("kind", slice_of(KINDS, ["plain", "stiffening"]))
def test_a_load_is_that_where_the_gauges_show_it_less_the_gain(kind: str):
    """Draw by draw: from the load as read at what the gauges of that draw show."""
    plain, stated = pair(**KINDS[kind])
    load, gauges = centre(stated, "load"), drawn_gauges()
    for one in range(0, SIZE, 500):
        gain, stretch, offset = (gauges[name][one] for name in SDS)
        shown = (1.0 + stretch) * AT, 20.0 + offset
        there = centre(plain, "load", *shown)[one] / (1.0 + gain)
        assert load[one] == pytest.approx(there, rel=1e-12)
    wider = load.std() / centre(plain, "load").std()
    assert wider > 1.05


def test_the_load_widens_by_the_root_sum_of_squares():
    plain, stated = pair(deformation_offset=np.zeros(SIZE))
    before, after = (np.log(centre(one, "load")).std() for one in (plain, stated))
    gains = [SDS[name] for name in GAINS]
    warm = 3e-4 * SDS["temperature_offset"]
    assert after == pytest.approx(np.linalg.norm([before, *gains, warm]), rel=0.05)


def test_a_gear_alone_is_stiff_as_it_is():
    _, stated = pair(deformation_offset=np.full(SIZE, 0.01))
    at = np.array([0.2, AT])
    found = np.asarray(gear_forces(stated.problem, stated.draws, at, np.full(2, 20.0)))
    # At the reference, a true one, nothing but the stiffness counts.
    wanted = at[:, None] * stated.draws["stiffness"]
    np.testing.assert_allclose(found, wanted, rtol=1e-12)


def test_bands_are_of_readings():
    plain, stated = pair()
    bands = [hdcal.predict(one, [0.1, AT], [20.0, 50.0]) for one in (plain, stated)]
    for name in ("physics_lo_N", "physics_hi_N", "new_measurement_hi_N"):
        columns = [getattr(one, name) for one in bands]
        np.testing.assert_allclose(columns[1], columns[0], rtol=1e-9)


def test_a_stream_of_readings_begins_as_the_rig_reads():
    plain, stated = (draw_forces.draws_of(each)[0] for each in pair())
    np.testing.assert_allclose(stated.stiffness, plain.stiffness, rtol=1e-9)
    where = np.array([0.1, AT]), np.full(2, 20.0)
    np.testing.assert_allclose(stated.at(*where).mean, plain.at(*where).mean, rtol=1e-9)


def test_the_derivative_of_a_load_goes_through_the_gauges():
    """The deformation that a load reaches is the one at which it is needed."""
    _, stated = pair()
    found = hdcal.margin(
        stated, AT, quantity="load", given_force=82.0, sensitivities=False
    )
    assert found.reached is not None and found.reached.median_mm is not None
    load = centre(stated, "load", deformation=found.reached.median_mm)
    assert np.median(load) == pytest.approx(82.0, rel=2e-3)


def test_force_of_takes_true_conditions():
    """By hand: one draw, one row."""
    _, stated = pair()
    value = {name: jnp.asarray(v[7]) for name, v in stated.draws.items()}
    records = grid_records(np.array([AT]), np.array([35.0]), np.ones(1), 0.0)
    force, _ = force_of(stated.problem, value, records, quantity="load")
    gain, stretch, offset = (float(value[name]) for name in SDS)
    alpha, read = float(value["alpha"]), float(value["stiffness"])
    read *= (1.0 + gain) / (1.0 + stretch) / (1.0 - alpha * offset)
    read *= 1.0 - alpha * (15.0 + offset)
    zero = float(value["deformation_offset"])
    wanted = read * ((1.0 + stretch) * AT - zero) / (1.0 + gain)
    assert float(force[0]) == pytest.approx(wanted, rel=1e-12)


# --- made-up rigs: what an interval of 95 % holds ---


def short(hits: np.ndarray, share: float = 0.95) -> float:
    """Return the probability of so few hits, or fewer."""
    return float(stats.binom.cdf(np.sum(hits), len(hits), share))


@pytest.mark.thorough
def test_a_slice_of_coverage(monkeypatch):
    held = coverage(TOLD, range(12))[:, :3]
    assert min(map(short, held.T)) > 1e-3
    # A displacement gauge's certificate does not say where the contact was.
    load, _, reading = coverage(TOUCHED, range(8))[:, :3].T
    assert short(load) < 1e-3 < short(reading)
    # A few rigs flag gains that are ignored, if coarse, and no reading shows them.
    coarse = certificates.STATED.replace("expanded_percent = 1.0", COARSE)
    assert coarse != certificates.STATED
    gear = certificates.gear_of(certificates.SIZES + coarse)
    contenders = {TOLD: gear, WRONG: replace(gear, gauge_priors={})}
    monkeypatch.setattr(certificates, "gears", lambda: contenders)
    load, stiffness, reading = coverage(WRONG, range(12))[:, :3].T
    assert max(short(load), short(stiffness)) < 1e-3 < short(reading)


@pytest.mark.slow
def test_loads_cover():
    contenders = (TOLD, WRONG, SILENT, TOUCHED)
    found = {name: coverage(name, range(1000, 1300)) for name in contenders}
    share = {name: rows[:, :3].mean(axis=0) for name, rows in found.items()}
    print({name: held.round(3).tolist() for name, held in share.items()})
    assert ((share[TOLD] >= 0.93) & (share[TOLD] <= 0.985)).all()
    assert share[WRONG][1] < 0.85 and share[SILENT][1] < 0.85
    assert share[TOUCHED][0] < 0.6
    # Without a certificate of its zero a load is known to 5 N, whatever the data; with
    # one as well as three mountings tell the mean of theirs.
    widths = [np.median(found[name][:, 3]) for name in (TOLD, SILENT)]
    assert widths[1] > 2.0 * widths[0]
