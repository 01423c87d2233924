"""What repeats by the clock is found, though it has no period from row to row."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import NOISE, rich, simulated
from slices import slice_of

from hdcal.data.priors import effect_priors
from hdcal.evidence.compute_evidence import compute_evidence
from hdcal.evidence.local_structure import direction_families
from hdcal.physics.registry import EFFECTS

LIBRARY = {name: EFFECTS[name] for name in ("coulomb_friction", "thermal_zero_drift")}


def gained(
    period: float | None, *, told: bool = True, pause: float = 0.0
) -> tuple[float, str]:
    """Return how much unknown structure gains over none [nat], and along what.

    Args:
        period: of a hum of twice the noise [s]; None without one.
        told: whether the time of each row is known.
        pause: in the middle of the rows [s].
    """
    case = simulated(rich(), seed=2)
    clock = np.asarray(case.records.time) + pause * (np.arange(180) >= 90)
    records = replace(case.records, time=clock)
    if period is not None:
        hum = 2.0 * np.sqrt(2.0) * NOISE * np.sin(2.0 * np.pi * clock / period)
        records = replace(records, force=records.force + hum)
    if not told:
        # Rates go with the time.
        known = records.known - {"time", "rates", "holds or rates"}
        records = replace(records, known=known)
    found = compute_evidence(replace(case, records=records), LIBRARY, effect_priors())
    whole = {n: np.logaddexp.reduce(found.table[n]) for n in ("none", "unknown")}
    return float(whole["unknown"] - whole["none"]), found.likeliest_kernel


def test_a_hum_by_the_clock_is_unknown_structure():
    """Readings 1 s and 4 s apart, with pauses, have no period of rows."""
    found, kernel = gained(7.3, told=True)
    assert kernel == "period of time"
    assert found > 30.0
    assert found > gained(7.3, told=False)[0] + 20.0


@pytest.mark.parametrize("pause", slice_of([600.0, 86_400.0], [86_400.0]))
def test_a_pause_weakens_it_and_does_not_hide_it(pause):
    """The phase is lost there: one wave fits both parts of the rows by chance only."""
    found = gained(7.3, pause=pause)[0]
    assert 3.0 < found < gained(7.3)[0]


def test_nothing_is_found_where_nothing_hums():
    assert gained(None, told=True)[0] < 1.0


def test_an_even_clock_says_no_more_than_the_rows():
    records = rich()
    even = replace(records, time=2.0 * np.arange(len(records.time)))
    names = [[f.name for f in direction_families(r)] for r in (records, even)]
    assert {*names[0]} - {*names[1]} == {"period of time"}


@pytest.mark.parametrize("turns", [2, 7, 40])
def test_its_waves_have_whole_turns_of_the_clock(turns):
    records = rich()
    clock = np.asarray(records.time) - records.time[0]
    (family,) = (f for f in direction_families(records) if f.name == "period of time")
    wave = family.columns[2 * (turns - 2)]
    expected = np.cos(2.0 * np.pi * turns * clock / clock[-1])
    np.testing.assert_allclose(wave, expected, atol=1e-9)
