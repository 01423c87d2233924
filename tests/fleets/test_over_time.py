"""Changes of stiffness, zero and noise with the date, apart from each other."""

import numpy as np
import pandas as pd
import pytest
from handmade_fleet import fitted

import hdcal
from hdcal.errors import Finding
from hdcal.fleets import over_time as times
from hdcal.fleets.over_time import Change, over_time
from hdcal.fleets.reading.readings import FleetReadings, fleet_readings

DAYS, X = 20, np.linspace(0.05, 0.5, 12)


def measured(
    stiffness=0.0, zero=0.0, noise=1.0, drift=0.0, side=1, **columns
) -> FleetReadings:
    """Return two gears a day, mounted twice; the second half of the days differs."""
    rng, parts = np.random.default_rng(8), []
    for gear in range(2 * DAYS):
        day = gear // 2
        late = day >= DAYS // 2
        k = 200.0 * (1.0 + 0.01 * rng.standard_normal() + stiffness * late)
        k *= 1.0 + drift * day / DAYS
        for run in range(2):
            force = side * k * X + 0.3 * rng.standard_normal() + zero * late
            force += 0.3 * (noise if late else 1.0) * rng.standard_normal(len(X))
            table = {"gear": f"G{gear}", "run": run, "date": f"2026-03-{day + 1:02d}"}
            table |= {name: make(gear, run) for name, make in columns.items()}
            table |= {"deformation_mm": side * X, "force_N": force}
            parts.append(pd.DataFrame(table))
    return fleet_readings(hdcal.read_case(pd.concat(parts)))


def changes(readings: FleetReadings) -> dict[str, Change]:
    return {one.what: one for one in over_time(readings, fitted(readings))}


def changed(found: dict[str, Change]) -> list[str]:
    return [name for name, one in found.items() if one.changed]


def test_nothing_changes_where_nothing_does():
    found = changes(measured())
    assert {*found} == {"stiffness", "zero", "noise"}
    assert not changed(found)
    assert (found["zero"].first, found["zero"].last) == ("2026-03-01", "2026-03-20")
    # Both mountings of a gear are of one day and share the error of its slope.
    assert {len(one.values.value) for one in found.values()} == {2 * DAYS}
    error = found["stiffness"].values.sd
    xx = 2.0 * len(X) * np.var(X)
    assert np.median(error) == pytest.approx(100.0 * 0.3 / 200.0 / xx**0.5, rel=0.15)
    error = 0.3 * np.sqrt(0.5 / len(X) + np.mean(X) ** 2 / xx)
    assert np.median(found["zero"].values.sd) == pytest.approx(error, rel=0.15)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(
    ("change", "what", "size"),
    [
        ({"stiffness": -0.04}, "stiffness", -4.0),
        ({"zero": 1.5}, "zero", 1.5),
        ({"noise": 2.0}, "noise", 100.0 * np.log(2.0)),
    ],
)
def test_a_step_is_reported_of_what_changes_only(change, what, size, side):
    found = changes(measured(**change, side=side))
    assert changed(found) == [what]
    (step,) = found[what].steps
    assert found[what].likeliest == "steps"
    assert step.after <= "2026-03-10" < "2026-03-11" <= step.before
    assert step.size.lo < size < step.size.hi


def test_more_dates_than_are_distinguished_are_grouped(monkeypatch):
    monkeypatch.setattr(times, "_MOST_DATES", 7)
    one = changes(measured(stiffness=-0.04))["stiffness"]
    assert (one.dates, one.first, one.last) == (DAYS, "2026-03-01", "2026-03-20")
    (step,) = one.steps
    assert step.after <= "2026-03-10" < "2026-03-11" <= step.before


def test_a_drift_is_reported():
    one = changes(measured(drift=0.1))["stiffness"]
    # In percent of the centre, which is that of the middle day.
    size = 100.0 * 0.1 * (DAYS - 1) / DAYS / 1.05
    assert one.changed and one.likeliest == "drift"
    assert one.drift.lo < size < one.drift.hi


def test_what_lots_rigs_and_operators_differ_by_is_no_change():
    for kind in ("lot", "rig"):
        late = {kind: lambda gear, run: "AB"[gear >= DAYS]}
        readings = measured(stiffness=-0.04, **late)
        fit = fitted(readings)
        offset = np.full_like(fit.draws["stiffness"], 0.02)
        fit.draws.update({f"{kind}_1": offset, f"{kind}_2": -offset})
        assert not any(one.changed for one in over_time(readings, fit))
    late = {"operator": lambda gear, run: "AB"[gear >= DAYS]}
    readings = measured(zero=1.5, **late)
    fit = fitted(readings)
    offset = np.full_like(fit.draws["stiffness"], 0.75)
    fit.draws.update({"operator_1": -offset, "operator_2": offset})
    assert not any(one.changed for one in over_time(readings, fit))


# Several in a row may be a change.
@pytest.mark.parametrize("names", [["G22"], [f"G{gear}" for gear in range(30, 40)]])
def test_a_flagged_gear_alone_is_left_out_and_no_change(names):
    readings, left_out = measured(), tuple(names) if len(names) == 1 else ()
    labels = np.array(readings.case.specimen_labels)
    odd = readings.at_one_size(np.where(np.isin(labels, names), 1.0 / 0.9, 1.0))
    fit = fitted(odd, {name: ["stiffness"] for name in names})
    one = over_time(odd, fit)[0]
    assert one.left_out == left_out and one.changed == (not left_out)


def test_one_date_or_none_is_no_time():
    late = {f"G{gear}": Finding("", "", "") for gear in range(2 * DAYS - 2)}
    assert changes(measured().without(late)) == {}
    without = hdcal.read_case(
        {
            "gear": list("AAABBBCCC"),
            "deformation_mm": [0, 1, 2] * 3,
            "force_N": [0, 1, 2.1] * 3,
        },
    )
    assert over_time(fleet_readings(without), fitted(fleet_readings(without))) == ()


def test_no_change_of_the_zero_where_few_zeros_are_far_from_the_readings():
    """Zeros of a gear share the error of its slope; 5 % may be false."""
    false = 0
    for seed in range(10):
        rng, parts = np.random.default_rng(seed), []
        x = np.linspace(0.3, 0.5, 8)
        for gear in range(12):
            for run in range(2):
                force = 200.0 * x + 0.5 * rng.standard_normal(len(x))
                force += 0.02 * rng.standard_normal()
                day = {"date": f"2026-03-{gear + run + 1:02d}", "run": run}
                table = {"gear": gear, **day, "deformation_mm": x, "force_N": force}
                parts.append(pd.DataFrame(table))
        readings = fleet_readings(hdcal.read_case(pd.concat(parts)))
        false += changes(readings)["zero"].changed
    assert false <= 2
