"""Without a column `run` dates, rigs and operators tell mountings apart."""

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
NAMES = ("specimen", "date", "rig", "operator")


def table(mounted=MOUNTED, names=NAMES) -> pd.DataFrame:
    parts = [
        pd.DataFrame(
            dict(zip(names, labels, strict=True))
            | {"deformation_mm": X, "force_N": 200.0 * X + place}
        )
        for place, labels in enumerate(mounted)
    ]
    return pd.concat(parts, ignore_index=True)


def labels_of(gear: str, **told: str) -> list[str] | None:
    """Return the labels of rows, a letter for each gear and label; blanks are empty."""
    values = {
        name: np.array([NOT_STATED if c == " " else c for c in cells], object)
        for name, cells in told.items()
    }
    labels = run_labels(values, pd.factorize(np.array([*gear], object))[0])
    return None if labels is None else labels.tolist()


def test_each_day_and_rig_of_a_gear_is_a_mounting():
    case = read_case(table())
    assert case.run_labels == (
        "A/2026-10-01 south",
        "A/2026-10-12 north",
        "B/2026-10-01 south",
        "C/2026-10-02 north",
        "A/2026-10-12 south",
    )
    assert case.records.run.tolist() == np.repeat(range(5), 5).tolist()
    assert case.specimen_labels == ("A", "B", "C")
    assert case.rigs == ("south", "north", "south", "north", "south")
    assert case.operators == ("Ana", "Ana", "Ana", "Ben", "Ana")
    assert {"run", "runs"} <= case.records.known


def test_they_are_those_of_a_column_run():
    rows = table()
    run = rows["specimen"] + rows["date"] + rows["rig"]
    case, other = read_case(rows), read_case(rows.assign(run=run))
    for name, value in vars(case.records).items():
        assert np.array_equal(value, getattr(other.records, name)), name
    assert (case.dates, case.rigs) == (other.dates, other.rigs)


def test_only_the_day_of_a_time_stamp_counts(tmp_path):
    rows = table(MOUNTED[:4])
    minutes = pd.to_timedelta(7 * rows.index, unit="min")
    stamped = rows.assign(date=pd.to_datetime(rows["date"]) + minutes)
    written = stamped.assign(date=stamped["date"].dt.strftime("%d.%m.%Y %H:%M"))
    written.to_csv(tmp_path / "line.csv", index=False)
    for data in (stamped, written, tmp_path / "line.csv"):
        case = read_case(data)
        assert case.run_labels == read_case(rows).run_labels
        assert np.array_equal(case.records.run, read_case(rows).records.run)


def test_rows_of_mountings_need_not_stand_together():
    rows = table(MOUNTED[:2]).sample(frac=1.0, random_state=2)
    case = read_case(rows)
    first = case.records.run == case.rigs.index("south")
    assert np.array_equal(first, rows["rig"] == "south")


@pytest.mark.parametrize(
    ("told", "labels"),
    [
        # That of the row above: of the same gear, and of no other.
        ({"rig": "s nn ", "gear": "AAAAA"}, ["s", "s", "n", "n", "n"]),
        ({"rig": "sn  ", "gear": "AAAB"}, ["s", "n", "n", NOT_STATED]),
        # One below tells it too.
        ({"rig": " sn", "gear": "AAA"}, ["s", "s", "n"]),
        # Two halves are a whole, which a third row fits.
        ({"rig": "s s", "operator": " KK", "gear": "AAA"}, None),
        ({"rig": "ss ", "operator": "KMB", "gear": "AAA"}, ["K", "M", "B"]),
    ],
)
def test_an_empty_cell_is_no_mounting(told, labels):
    assert labels_of(**told) == labels


def test_dates_that_cannot_be_read_tell_none_apart():
    rows = table(MOUNTED[:2]).assign(rig="south")
    assert len(read_case(rows.assign(date=[*"abcdefghij"])).run_labels) == 1
    # In two ways, but another day in both.
    days = np.repeat(["01/02/2026 10:00", "03/02/2026 10:00"], 5)
    assert read_case(rows.assign(date=days)).run_labels == ("01/02/2026", "03/02/2026")
    # One that is misspelt is that of the rows above.
    days = [*rows["date"][:9], "2026-1o-12"]
    assert read_case(rows.assign(date=days)).records.run.tolist() == [0] * 5 + [1] * 5


def test_days_of_other_clocks():
    """AM and PM are read; what means another day whenever it is read is none."""
    rows = table(MOUNTED[:2]).assign(rig="south")
    days = np.repeat(["10/13/2026 8:00 AM", "10/14/2026 1:30 PM"], 5)
    case = read_case(rows.assign(date=days))
    assert case.run_labels == ("2026-10-13", "2026-10-14")
    assert case.dates == ("2026-10-13T08:00:00", "2026-10-14T13:30:00")
    assert len(read_case(rows.assign(date=["today", "now"] * 5)).run_labels) == 1
