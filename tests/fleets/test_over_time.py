"""What a fleet says of dates: in its answer, in its sentences and in its pictures."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

import hdcal
from hdcal.errors import InputError
from hdcal.fleets import over_time
from hdcal.fleets.figure import time_figure
from hdcal.fleets.over_time import time_answer, time_series
from hdcal.fleets.summary import fleet_answer
from hdcal.fleets.time_chart import time_charts
from hdcal.quantities import FORCE

DAYS = 20


def measured(stiffness=0.0, zero=0.0, noise=1.0, drift=0.0, dated=True):
    """Return two gears a day, mounted twice: from the middle on something else."""
    rng, parts = np.random.default_rng(8), []
    x = np.linspace(0.05, 0.5, 12)
    for gear in range(2 * DAYS):
        day = gear // 2
        late = day >= DAYS // 2
        k = 200.0 * (1.0 + 0.01 * rng.standard_normal() + stiffness * late)
        k *= 1.0 + drift * day / DAYS
        for run in range(2):
            force = k * x + 0.3 * rng.standard_normal() + zero * late
            force += 0.3 * (noise if late else 1.0) * rng.standard_normal(len(x))
            told = {"date": f"2026-03-{day + 1:02d}"} if dated else {}
            columns = {"deformation_mm": x, "force_N": force}
            parts.append(
                pd.DataFrame({"gear": f"G{gear}", "run": run, **told, **columns})
            )
    return hdcal.read_case(pd.concat(parts, ignore_index=True), theory="spring")


def answers(**changed):
    found = hdcal.fleet(measured(**changed))
    return found, {each.what: each for each in fleet_answer(found).over_time}


def test_nothing_is_told_to_change_where_nothing_does():
    _, told = answers()
    assert {*told} == {"stiffness", "zero", "noise"}
    assert not any(each.changed for each in told.values())
    assert told["stiffness"].dates == DAYS
    assert (told["zero"].first, told["zero"].last) == ("2026-03-01", "2026-03-20")


@pytest.mark.parametrize(
    ("change", "what", "size"),
    [
        ({"stiffness": -0.04}, "stiffness", -4.0),
        ({"zero": 1.5}, "zero", 1.5),
        ({"noise": 2.0}, "noise", 100.0 * np.log(2.0)),
    ],
)
def test_a_step_is_told_of_what_changes_only(change, what, size):
    _, told = answers(**change)
    assert [name for name, each in told.items() if each.changed] == [what]
    (step,) = told[what].steps
    assert told[what].likeliest == "steps"
    assert step.after <= "2026-03-10" < "2026-03-11" <= step.before
    assert step.size.lo < size < step.size.hi


def test_a_drift_is_told():
    _, told = answers(drift=0.1)
    # In percent of the centre, which is that of the middle day.
    size = 100.0 * 0.1 * (DAYS - 1) / DAYS / 1.05
    assert told["stiffness"].changed
    assert told["stiffness"].likeliest == "drift"
    assert told["stiffness"].drift.lo < size < told["stiffness"].drift.hi


def test_a_gear_that_is_off_is_no_change():
    case = measured()
    off = np.asarray(case.records.specimen) == 22
    force = np.where(off, 0.9, 1.0) * np.asarray(case.records.force)
    case = hdcal.read_case(
        {
            "gear": np.asarray(case.records.specimen).astype(str),
            "run": np.asarray(case.records.run).astype(str),
            "date": np.array(case.dates)[np.asarray(case.records.run)],
            "deformation_mm": np.asarray(case.records.deformation),
            "force_N": force,
        },
        theory="spring",
    )
    found = hdcal.fleet(case)
    stiffness = fleet_answer(found).over_time[0]
    assert not stiffness.changed
    assert "22" in stiffness.left_out


def test_without_dates_nothing_is_said():
    found = hdcal.fleet(measured(dated=False))
    assert fleet_answer(found).over_time == ()


def test_the_pictures_show_every_value_and_its_limits():
    found = hdcal.fleet(measured(stiffness=-0.04))
    series = time_series(found)
    stiffness, zero, noise, sums = time_charts(series, FORCE)
    assert len(stiffness.names) == len(noise.names) == 2 * DAYS
    # Both mountings of a gear were on one day.
    assert len(zero.names) == 2 * DAYS
    assert stiffness.names[0] == "03-01 G0"
    # A step of four standard deviations leaves the limits of the sums, if not others.
    softer = next(s for s in sums.series if s.label.startswith("sum of softer"))
    assert np.min(softer.y[DAYS:]) < -5.0
    figure = time_figure(series, FORCE)
    assert isinstance(figure, Figure)
    assert len(figure.axes) == 4
    assert time_answer(series[0]).changed


def test_what_was_read_since_a_day_is_told_alone():
    case = measured(zero=1.5)
    whole, late = hdcal.fleet(case), hdcal.fleet(case, since="2026-03-11")
    gears = [str(gear) for gear in late.case.specimen_labels]
    assert gears == [f"G{gear}" for gear in range(DAYS, 2 * DAYS)]
    assert late.rows.sum() == whole.rows.sum() // 2
    assert np.median(late.draws["run_offset_sd"]) < 0.4
    assert np.median(whole.draws["run_offset_sd"]) > 0.6
    assert np.median(late.draws["zero"]) > 1.2
    assert any("before 2026-03-11 is left out" in note for note in late.case.notes)
    # As if the rows before had never been read.
    records = case.records
    rows = np.array(case.dates)[np.asarray(records.run)] >= "2026-03-11"
    again = hdcal.fleet(
        hdcal.read_case(
            {
                "gear": np.array(case.specimen_labels)[
                    np.asarray(records.specimen)[rows]
                ],
                "run": np.array(case.run_labels)[np.asarray(records.run)[rows]],
                "deformation_mm": np.asarray(records.deformation)[rows],
                "force_N": np.asarray(records.force)[rows],
            },
            theory="spring",
        )
    )
    for name in ("x", "y", "xx", "xy", "yy"):
        one, other = (getattr(f.readings.sums, name) for f in (late, again))
        assert one == pytest.approx(other)


@pytest.mark.parametrize(
    ("day", "why"), [("soon", "is no day"), ("2027-01-01", "nothing was read")]
)
def test_a_day_that_leaves_nothing_is_refused(day, why):
    with pytest.raises(InputError, match=why):
        hdcal.fleet(measured(), since=day)


def test_without_dates_no_day_can_be_asked_for():
    with pytest.raises(InputError, match="no dates are told"):
        hdcal.fleet(measured(dated=False), since="2026-03-11")


def far(value, sd=0.1):
    value = np.asarray(value, float)
    return np.flatnonzero(over_time._wild(value, np.full(len(value), sd))).tolist()


def test_a_value_far_from_its_neighbours_is_left_out_and_a_bad_day_is_not():
    rng = np.random.default_rng(2)
    value = rng.standard_normal(30)
    assert far(value) == []
    value[12] -= 9.0
    assert far(value) == [12]
    value[13:15] -= 9.0
    assert far(value) == []


def test_what_was_read_badly_is_not_far():
    rng = np.random.default_rng(2)
    sd = np.where(np.arange(60) % 5 == 0, 5.0, 0.3)
    found = over_time._wild(sd * rng.standard_normal(60), sd)
    assert found.sum() <= 1


@pytest.mark.thorough
def test_zeros_of_one_gear_that_share_its_slope_are_no_change():
    """Far from zero all zeros of a gear are off alike: days would seem to differ."""
    x, rng, told = np.linspace(0.3, 0.5, 8), np.random.default_rng(1), []
    for _ in range(6):
        parts = [
            pd.DataFrame(
                {
                    "gear": f"G{gear}",
                    "run": run,
                    "date": f"2026-03-{gear + 1:02d}",
                    "deformation_mm": x,
                    "force_N": 200.0 * (1.0 + 0.01 * slope) * x
                    + 0.05 * rng.standard_normal()
                    + 0.5 * rng.standard_normal(len(x)),
                }
            )
            for gear, slope in enumerate(rng.standard_normal(16))
            for run in range(5)
        ]
        case = hdcal.read_case(pd.concat(parts, ignore_index=True), theory="spring")
        told += [one.changed for one in fleet_answer(hdcal.fleet(case)).over_time]
    assert np.mean(told) <= 0.1


def test_dates_of_which_but_one_is_left_say_nothing():
    """The only gear of the second day is far from all others."""
    case = measured()
    gear, run = np.asarray(case.records.specimen), np.asarray(case.records.run)
    last = gear == DAYS - 1
    frame = {
        "gear": gear.astype(str),
        "run": run.astype(str),
        "date": np.where(last, "2026-03-02", "2026-03-01"),
        "deformation_mm": np.asarray(case.records.deformation),
        "force_N": np.where(last, 0.7, 1.0) * np.asarray(case.records.force),
    }
    kept = gear < DAYS
    found = hdcal.fleet(
        hdcal.read_case({n: v[kept] for n, v in frame.items()}, theory="spring")
    )
    assert {one.what for one in fleet_answer(found).over_time} <= {"zero", "noise"}
