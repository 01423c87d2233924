"""What a fleet says of dates: in its answer, in its sentences and in its pictures."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

import hdcal
from hdcal.fleets.figure import time_figure
from hdcal.fleets.over_time import time_answer, time_series
from hdcal.fleets.summary import fleet_answer, fleet_report
from hdcal.fleets.time_chart import time_charts

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
    found, told = answers(**change)
    assert [name for name, each in told.items() if each.changed] == [what]
    (step,) = told[what].steps
    assert told[what].likeliest == "steps"
    assert step.after <= "2026-03-10" < "2026-03-11" <= step.before
    assert step.size.lo < size < step.size.hi
    said = fleet_report(found).document.answers[0]
    assert "changes with the date" in said
    assert ("as if it did not" in said) == (what == "stiffness")


def test_a_drift_is_told():
    _, told = answers(drift=0.1)
    # In percent of the centre, which is that of the middle day.
    size = 100.0 * 0.1 * (DAYS - 1) / DAYS / 1.05
    assert told["stiffness"].changed
    assert told["stiffness"].likeliest == "drift"
    assert told["stiffness"].drift.lo < size < told["stiffness"].drift.hi


def test_a_gear_that_is_off_is_no_change():
    frame = measured().records
    assert frame is not None
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
    headings = [each.heading for each in fleet_report(found).document.sections]
    assert "Over time" not in headings


def test_the_pictures_show_every_value_and_its_limits():
    found = hdcal.fleet(measured(stiffness=-0.04))
    series = time_series(found)
    stiffness, zero, noise, sums = time_charts(series)
    assert len(stiffness.names) == len(noise.names) == 2 * DAYS
    assert len(zero.names) == 4 * DAYS
    assert stiffness.names[0] == "03-01 G0"
    # A step of four standard deviations leaves the limits of the sums, if not others.
    softer = next(s for s in sums.series if s.label.startswith("sum of softer"))
    assert np.min(softer.y[DAYS:]) < -5.0
    figure = time_figure(series)
    assert isinstance(figure, Figure)
    assert len(figure.axes) == 4
    assert time_answer(series[0]).changed
