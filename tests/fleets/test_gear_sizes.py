"""Sizes of each gear in a table: the stiffness that they make, and their faults."""

import numpy as np
import pandas as pd
import pytest
from gear_records import SIZES, records, refused

from hdcal.data.reading import read_case
from hdcal.fleets.reading.gear_sizes import gear_sizes
from hdcal.fleets.reading.read_fleet import read_fleet, usable

WALLS = 0.68 * np.linspace(0.9, 1.1, 8)
TABLE = pd.DataFrame(
    {"gear": [f"G{gear}" for gear in range(8)], "wall_thickness_mm": WALLS}
)


def case(gear=SIZES):
    return read_case(records(), gear)


def test_stiffness_grows_with_the_cube_of_the_wall(tmp_path):
    ratio, unsized = gear_sizes(TABLE.sample(frac=1.0, random_state=1), case())
    assert ratio == pytest.approx((WALLS / 0.68) ** 3) and not unsized
    TABLE.to_csv(tmp_path / "sizes.csv", index=False, sep=";", decimal=",")
    again, _ = gear_sizes(tmp_path / "sizes.csv", case())
    assert again == pytest.approx(ratio)


def test_the_load_acts_at_the_end_of_another_length_unless_its_height_is_stated():
    cup = SIZES | {"theory": "cup"}
    given = TABLE.assign(length_mm=80.0)
    at_end = gear_sizes(given, case(cup))[0]
    stated = given.assign(load_height_mm=80.0)
    assert at_end == pytest.approx(gear_sizes(stated, case(cup))[0])
    assert not gear_sizes(TABLE.assign(length_mm=60.0), case(cup))[1]
    fixed = gear_sizes(given, case(cup | {"load_height_mm": 70.0}))[0]
    assert np.all(np.abs(fixed / at_end - 1.0) > 0.01)


def test_a_gear_without_a_size_is_left_out_and_an_impossible_size_refused():
    readings, table = read_fleet(records(), SIZES), TABLE.drop(index=6)
    assert "1 of 8 gears is faulty" in refused(usable, readings, table)[-1]
    found = usable(readings, table, skip_bad=True)
    assert {*found.case.left_out} == {"G6"}
    assert found.size_ratio == pytest.approx((WALLS[[0, 1, 2, 3, 4, 5, 7]] / 0.68) ** 3)
    table = TABLE.astype({"wall_thickness_mm": object})
    table.loc[1, "wall_thickness_mm"] = "thin"
    table.loc[3, "wall_thickness_mm"] = 50.0
    table = pd.concat([table, table.iloc[[4]]])
    assert len(refused(usable, readings, table, skip_bad=True)) == 3


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (TABLE.drop(columns="wall_thickness_mm"), "no column of sizes"),
        (TABLE.rename(columns={"gear": "name"}), "the gear of a row"),
        (TABLE.assign(**{"radius [mm]": 60.0}), "not read under this name"),
        ([1, 2], "is a list"),
        ("none.csv", "does not exist"),
    ],
)
def test_a_table_that_cannot_be_read_is_refused(given, words):
    assert any(words in one for one in refused(gear_sizes, given, case()))


def test_without_sizes_in_a_gear_file_a_table_has_no_meaning():
    assert "need a gear file" in refused(gear_sizes, TABLE, case(None))[0]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (TABLE.assign(wall_thickness_mm=50.0), "not less than the radius"),
        (TABLE.assign(load_height_mm=90.0), "beyond the length"),
        (TABLE.assign(wall_thickness_mm=-1.0), "-1"),
        (TABLE.iloc[:0], "has no row"),
    ],
)
def test_sizes_that_cannot_be_leave_no_gear(given, words):
    found = refused(usable, read_fleet(records(), SIZES), given, skip_bad=True)
    assert any(words in one for one in found)
