"""Dates are read as rigs write them; without a column `run` they separate mountings."""

import numpy as np
import pandas as pd
import pytest

from hdcal.data.measurements.labels import run_labels
from hdcal.data.reading import read_case
from hdcal.data.tables.cells import NOT_STATED

X = np.linspace(0.1, 0.5, 5)
# Gear, date, rig, operator of each mounting.
MOUNTED = [
    ("A", "2026-10-01", "south", "Ana"),
    ("A", "2026-10-12", "north", "Ana"),
    ("B", "2026-10-01", "south", "Ana"),
    ("C", "2026-10-02", "north", "Ben"),
    ("A", "2026-10-12", "south", "Ana"),
]


def table(mounted=MOUNTED) -> pd.DataFrame:
    names = ("specimen", "date", "rig", "operator")
    parts = [
        pd.DataFrame(
            dict(zip(names, labels, strict=True))
            | {"deformation_mm": X, "force_N": 200.0 * X + place}
        )
        for place, labels in enumerate(mounted)
    ]
    return pd.concat(parts, ignore_index=True)


def test_dates_in_iso_8601_are_read():
    case = read_case(table().assign(date="2026-09-03T00:30+02:00", run=range(25)))
    assert case.dates == ("2026-09-03T00:30:00",) * 25
    labels = ["2026-09-03", "2026-09-02", "", "", ""]
    case = read_case(table(MOUNTED[:2]).assign(date=labels * 2, run=[1] * 5 + [2] * 5))
    assert case.dates == ("2026-09-02T00:00:00",) * 2


@pytest.mark.parametrize("written", ["03/04/2026", "45123", "yesterday", "2026-13-01"])
def test_a_date_in_another_form_has_a_note(written):
    case = read_case(table().assign(date=written))
    assert case.dates == ()
    assert any(written in note and "year-month-day" in note for note in case.notes)


def test_each_day_and_rig_of_a_gear_is_a_mounting():
    case, rows = read_case(table()), table()
    assert case.run_labels == (
        "A/2026-10-01 south",
        "A/2026-10-12 north",
        "B/2026-10-01 south",
        "C/2026-10-02 north",
        "A/2026-10-12 south",
    )
    assert case.records.run.tolist() == np.repeat(range(5), 5).tolist()
    assert case.rigs == ("south", "north", "south", "north", "south")
    assert case.operators == ("Ana", "Ana", "Ana", "Ben", "Ana")
    assert sum("5 mountings of 3 gears" in note for note in case.notes) == 1
    # The same as with a column that names them.
    other = read_case(rows.assign(run=rows["specimen"] + rows["date"] + rows["rig"]))
    assert np.array_equal(case.records.run, other.records.run)
    assert (case.dates, case.rigs) == (other.dates, other.rigs)
    # Whatever the order of rows.
    mixed = table(MOUNTED[:2]).sample(frac=1.0, random_state=2)
    case = read_case(mixed)
    assert np.array_equal(
        case.records.run == case.rigs.index("south"), mixed["rig"] == "south"
    )


def test_only_the_day_of_a_time_stamp_counts():
    rows = table(MOUNTED[:4])
    minutes = pd.to_timedelta(7 * rows.index, unit="min")
    stamped = rows.assign(date=pd.to_datetime(rows["date"]) + minutes)
    written = stamped.assign(date=stamped["date"].dt.strftime("%d.%m.%Y %H:%M"))
    for data in (stamped, written):
        found = read_case(data).records.run
        assert np.array_equal(found, read_case(rows).records.run)


def test_dates_that_cannot_be_read_separate_no_mountings():
    rows = table(MOUNTED[:2]).assign(rig="south")
    assert len(read_case(rows.assign(date=[*"abcdefghij"])).run_labels) == 1
    # One that is misspelt is that of the rows above.
    days = [*rows["date"][:9], "2026-1o-12"]
    assert read_case(rows.assign(date=days)).records.run.tolist() == [0] * 5 + [1] * 5


@pytest.mark.parametrize(
    ("stated", "labels"),
    [
        # That of the row above: of the same gear, and of no other.
        ({"rig": "s nn ", "gear": "AAAAA"}, ["s", "s", "n", "n", "n"]),
        ({"rig": "sn  ", "gear": "AAAB"}, ["s", "n", "n", NOT_STATED]),
        # Or else that of the row below.
        ({"rig": " sn", "gear": "AAA"}, ["s", "s", "n"]),
        ({"rig": "s s", "operator": " KK", "gear": "AAA"}, None),
        ({"rig": "ss ", "operator": "KMB", "gear": "AAA"}, ["K", "M", "B"]),
    ],
)
def test_an_empty_cell_is_no_mounting(stated, labels):
    values = {
        name: np.array([NOT_STATED if c == " " else c for c in cells], object)
        for name, cells in stated.items()
        if name != "gear"
    }
    found = run_labels(values, pd.factorize(np.array([*stated["gear"]], object))[0])
    assert (None if found is None else found.tolist()) == labels
