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
TOLD = "without a column `run`"


def table(mounted=MOUNTED, names=NAMES) -> pd.DataFrame:
    parts = [
        pd.DataFrame(
            dict(zip(names, labels, strict=True))
            | {"deformation_mm": X, "force_N": 200.0 * X + place}
        )
        for place, labels in enumerate(mounted)
    ]
    return pd.concat(parts, ignore_index=True)


def notes(case) -> list[str]:
    return [note for note in case.notes if TOLD in note]


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


def test_it_is_said_once():
    (note,) = notes(read_case(table()))
    assert note == (
        "ASSUMED: without a column `run`, rows of a gear that differ in date, rig or "
        "operator are of different mountings: 5 mountings of 3 gears. If not, name the "
        "mountings in a column `run`"
    )
    rows = table([("A", "Ana"), ("A", "Ben")], ("serial", "inspector"))
    (note,) = notes(read_case(rows))
    assert "rows of a gear that differ in operator are" in note
    assert "2 mountings of 1 gear." in note


@pytest.mark.parametrize(
    "rows",
    [
        table().assign(run=1),
        table(MOUNTED[1:4]),
        table().drop(columns=["date", "rig"]),
        table().drop(columns=["date", "rig", "operator"]),
    ],
)
def test_nothing_is_said_where_nothing_changes(rows):
    case = read_case(rows)
    assert not notes(case)
    assert len(case.run_labels) == len(case.specimen_labels)


def test_one_gear_of_several_has_its_mountings():
    case = read_case(table(), specimen="A")
    assert case.records.run.tolist() == np.repeat(range(3), 5).tolist()
    assert case.run_labels[1] == "2026-10-12 north"
    assert "3 mountings of 1 gear." in notes(case)[0]


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


def test_time_may_restart_in_each_mounting():
    rows = table(MOUNTED[:4]).assign(time_s=np.tile(10.0 * X, 4))
    assert len(read_case(rows).run_labels) == 4


def test_rows_of_mountings_need_not_stand_together():
    rows = table(MOUNTED[:2]).sample(frac=1.0, random_state=2)
    case = read_case(rows)
    first = case.records.run == case.rigs.index("south")
    assert np.array_equal(first, rows["rig"] == "south")


@pytest.mark.parametrize(
    ("told", "labels"),
    [
        # The latest that fits: of the same gear, and of no other.
        ({"rig": "s nn ", "gear": "AAAAA"}, ["s", "s", "n", "n", "s"]),
        ({"rig": "sn  ", "gear": "AAAB"}, ["s", "n", "n", NOT_STATED]),
        # One below tells it too.
        ({"rig": " sn", "gear": "AAA"}, ["s", "s", "n"]),
        # Two halves are a whole, which a third row fits.
        ({"rig": "s s", "operator": " KK", "gear": "AAA"}, None),
        # What one column leaves open another tells.
        ({"rig": "sn ", "operator": "KMK", "gear": "AAA"}, ["s K", "n M", "s K"]),
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


def test_several_rigs_of_one_gear_are_warned_of():
    """What calibrates or diagnoses it has no gains of rigs; a fleet has."""
    rows = table()
    alone = read_case(rows[rows["specimen"] == "A"])
    assert sum("2 rigs read this gear" in note for note in alone.notes) == 1
    for other in (rows, rows[rows["specimen"] == "B"]):
        assert not any("rigs read this gear" in n for n in read_case(other).notes)


def test_labels_that_join_alike_are_of_two_mountings():
    labels = [("A", "A B", "C"), ("A", "A", "B C")]
    names = ("specimen", "rig", "operator")
    case = read_case(table(labels, names))
    assert case.run_labels == ("A B C", "A B C (2)")
    assert (case.rigs, case.operators) == (("A B", "A"), ("C", "B C"))


def test_days_of_other_clocks():
    """AM and PM are read; what means another day whenever it is read is none."""
    rows = table(MOUNTED[:2]).assign(rig="south")
    days = np.repeat(["10/13/2026 8:00 AM", "10/14/2026 1:30 PM"], 5)
    case = read_case(rows.assign(date=days))
    assert case.run_labels == ("2026-10-13", "2026-10-14")
    assert case.dates == ("2026-10-13T08:00:00", "2026-10-14T13:30:00")
    assert len(read_case(rows.assign(date=["today", "now"] * 5)).run_labels) == 1
