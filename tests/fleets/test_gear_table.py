"""Gears of several sizes come from one population, each with its own."""

import json

import numpy as np
import pandas as pd
import pytest
from commands import Hdcal

import hdcal
from hdcal.errors import InputError
from hdcal.fleets.readings import fleet_readings
from hdcal.fleets.summary import gear_columns
from hdcal.fleets.usable import usable

GEARS, WALL = 12, 0.68
SIZES = {"wall_thickness_mm": WALL, "radius_mm": 40.0, "length_mm": 70.0}
NAMED = SIZES | {"material": "steel", "deformation": "radial"}


def walls():
    return WALL * np.linspace(0.85, 1.2, GEARS)


def measured(off=None):
    """Return readings of rings whose walls differ by a third, and their stiffness."""
    rng = np.random.default_rng(5)
    x = np.linspace(0.05, 0.5, 15)
    stiffness = 90.0 * (walls() / WALL) ** 3 * (1.0 + 0.01 * rng.standard_normal(GEARS))
    if off is not None:
        stiffness[off] *= 0.85
    parts = [
        pd.DataFrame(
            {
                "gear": f"G{gear}",
                "run": run,
                "deformation_mm": x,
                "force_N": k * x + rng.normal(0.0, 0.5) + rng.normal(0.0, 0.2, len(x)),
            }
        )
        for gear, k in enumerate(stiffness)
        for run in range(2)
    ]
    return pd.concat(parts, ignore_index=True), stiffness


def table(**columns):
    names = [f"G{gear}" for gear in range(GEARS)]
    return pd.DataFrame({"gear": names, "wall_thickness_mm": walls()} | columns)


def size_ratios(given, case):
    return usable(fleet_readings(case), given)[1]


@pytest.fixture(scope="module")
def both():
    frame, stiffness = measured(off=4)
    case = hdcal.read_case(frame, gear=NAMED)
    return hdcal.fleet(case, gears=table()), hdcal.fleet(case), stiffness


def test_sizes_are_no_scatter(both):
    sized, unsized, _ = both
    assert np.quantile(sized.draws["specimen_sd"], 0.975) < 0.03
    assert np.median(unsized.draws["specimen_sd"]) > 0.1


def test_only_the_gear_that_is_off_for_its_size_is_called(both):
    sized, unsized, _ = both
    assert np.flatnonzero(sized.called).tolist() == [4]
    assert not unsized.called.any()


def test_each_gear_has_the_stiffness_of_its_own_size(both):
    sized, unsized, stiffness = both
    columns = gear_columns(sized)
    held = (columns["stiffness_lo"] < stiffness) & (stiffness < columns["stiffness_hi"])
    assert held.sum() >= GEARS - 2
    assert columns["size_ratio"] == pytest.approx((walls() / WALL) ** 3)
    assert np.ptp(np.delete(columns["K"], 4)) < 0.05 * np.mean(columns["K"])
    assert "size_ratio" not in gear_columns(unsized)


def test_a_length_of_its_own_is_that_of_the_load_too():
    case = hdcal.read_case(measured()[0], gear=NAMED | {"theory": "cup"})
    lengths = np.full(GEARS, 80.0)
    given = table(length_mm=lengths, wall_thickness_mm=WALL)
    loaded = size_ratios(given, case)
    at = size_ratios(given.assign(load_height_mm=lengths), case)
    assert loaded == pytest.approx(at)
    stated = hdcal.read_case(
        measured()[0], gear=NAMED | {"theory": "cup", "load_height_mm": 70.0}
    )
    assert size_ratios(given, stated)[0] != pytest.approx(at[0])


def wrong(given, gear=NAMED):
    with pytest.raises(InputError) as caught:
        size_ratios(given, hdcal.read_case(measured()[0], gear=gear, theory=None))
    return "\n".join(map(str, caught.value.findings))


def test_what_is_wrong_with_a_table_is_told_all_at_once():
    given = table().astype({"wall_thickness_mm": object})
    given.loc[2, "wall_thickness_mm"] = "thin"
    given.loc[3, "wall_thickness_mm"] = -1.0
    given.loc[5, "wall_thickness_mm"] = 50.0
    given = pd.concat([given.iloc[:-1], given.iloc[[0]]])
    told = wrong(given)
    for words in (
        "'thin' is not a number",
        "-1",
        "the wall is not thinner than the radius",
        "gear 'G0' has a row already",
        "gear 'G11' has no row",
    ):
        assert words in told


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (table().drop(columns="wall_thickness_mm"), "it states no sizes"),
        (table().rename(columns={"gear": "name"}), "which gear a row is of"),
    ],
)
def test_a_table_that_says_nothing_is_refused(given, words):
    assert words in wrong(given)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (table(wall_thickness_mm=50.0), "the wall is not thinner than the radius"),
        (table(radius_mm=0.5), "the wall is not thinner than the radius"),
        (table(load_height_mm=90.0), "the load acts beyond the length"),
        (table(**{"radius [mm]": 60.0}), "a size is not read under this name"),
        (table(length_um=60.0), "a size is not read under this name"),
        (table().iloc[:0], "has no row"),
        ([1, 2], "is a list"),
    ],
)
def test_sizes_that_cannot_be_or_are_not_read_are_refused(given, words):
    assert words in wrong(given)


def test_without_sizes_in_a_gear_file_a_table_says_nothing():
    assert "no gear file has sizes" in wrong(table(), gear=None)


@pytest.mark.thorough
def test_the_command_takes_a_table(here: Hdcal, tmp_path):
    frame, _ = measured(off=4)
    frame.to_csv(tmp_path / "line.csv", index=False)
    # As a German office writes it.
    table().to_csv(tmp_path / "gears.csv", index=False, sep=";", decimal=",")
    lines = [f"{name} = {value}" for name, value in SIZES.items()]
    (tmp_path / "gear.toml").write_text("\n".join(["[gear]", *lines]))
    out = tmp_path / "out"
    here("fleet", "line.csv", "--gears", "gears.csv", "--out", out)
    answer = json.loads((out / "summary.json").read_text("utf-8"))
    assert answer["called_off"] == ["G4"]
    given = ("fleet", "line.csv", "--gears", "none.csv", "--out", tmp_path / "no")
    ended = here(*given)
    assert ended.returncode == 2
    assert "none.csv" in ended.stderr
    assert not (tmp_path / "no").exists()
