"""Bad gears stop all, or are left out whole, which is said; the others are answered."""

import json

import numpy as np
import pandas as pd
import pytest
from commands import Hdcal
from schema_checks import obeys

import hdcal as api
from hdcal.data.measurements import parquet
from hdcal.errors import InputError
from hdcal.fleets import pool
from hdcal.fleets.answer import FleetAnswer
from hdcal.fleets.read_fleet import read_fleet
from hdcal.fleets.usable import usable

GEARS, ROWS = 8, 12
SIZES = {"wall_thickness_mm": 0.68, "radius_mm": 40.0, "length_mm": 70.0}


def measured() -> pd.DataFrame:
    """Return readings of gears G0, G1, … in two runs each, as text."""
    rng = np.random.default_rng(11)
    x = np.linspace(0.05, 0.5, ROWS)
    parts = [
        pd.DataFrame(
            {
                "gear": f"G{gear}",
                "run": run,
                "deformation_mm": x,
                "force_N": 200.0 * x * (1.0 + 0.01 * rng.standard_normal())
                + rng.normal(0.0, 0.5)
                + rng.normal(0.0, 0.2, ROWS),
            }
        )
        for gear in range(GEARS)
        for run in range(2)
    ]
    return pd.concat(parts, ignore_index=True).round(6).astype(object)


def row(gear: int, place: int) -> int:
    """Return where a reading of a gear stands; in a file it is two lines below."""
    return 2 * ROWS * gear + place


def told(make, *args, **kwargs) -> list[str]:
    with pytest.raises(InputError) as caught:
        make(*args, **kwargs)
    return [str(finding) for finding in caught.value.findings]


def same(one, other) -> None:
    """Check that readings are those of the same gears and mountings."""
    assert one.case.specimen_labels == other.case.specimen_labels
    assert one.case.run_labels == other.case.run_labels
    for name, column in vars(one.sums).items():
        assert np.asarray(column) == pytest.approx(
            np.asarray(getattr(other.sums, name))
        )
    for name in ("force", "deformation", "run", "specimen"):
        mine, theirs = (np.asarray(getattr(r.case.records, name)) for r in (one, other))
        assert len(mine) and np.array_equal(mine, theirs[: len(mine)]), name


def without(frame: pd.DataFrame, *gears: str) -> pd.DataFrame:
    return frame.loc[~frame["gear"].isin(gears)].reset_index(drop=True)


@pytest.fixture
def spoiled() -> pd.DataFrame:
    """Three gears with a bad cell: a word, an empty one, one beyond the radius."""
    frame = measured()
    frame.loc[row(1, 5), "force_N"] = "abc"
    frame.loc[row(1, 7), "force_N"] = "def"
    frame.loc[row(4, 0), "deformation_mm"] = ""
    frame.loc[row(6, 20), "deformation_mm"] = 45.0
    return frame


def test_gears_with_a_bad_cell_are_as_if_they_had_not_been_there(spoiled, tmp_path):
    spoiled.to_csv(tmp_path / "line.csv", index=False)
    found = read_fleet(tmp_path / "line.csv", SIZES, skip_bad=True)
    same(found, read_fleet(without(spoiled, "G1", "G4", "G6"), SIZES))
    why = found.case.left_out
    assert set(why) == {"G1", "G4", "G6"}
    assert (why["G1"].row, why["G1"].column) == (row(1, 5) + 2, "force_N")
    assert "'abc' is not a number" in why["G1"].problem
    assert "empty" in why["G4"].problem and "45 mm on a radius" in why["G6"].problem


def test_otherwise_they_stop_all_and_that_is_offered_once(spoiled):
    words = told(api.fleet, spoiled, SIZES)
    assert sum("skip_bad" in one for one in words) == 1
    assert words[-1].startswith("skip_bad: 3 of 8 gears are bad: 'G1', 'G4', 'G6'. ")
    (found,) = (one for one in words if "'abc'" in one)
    assert "row 31" in found and "also row 33" in found
    # Who cannot ask for it hears nothing of it.
    assert not any("skip_bad" in one for one in told(api.read_case, spoiled))


def test_what_a_bad_cell_hid_is_seen_without_it():
    """Beside whole numbers a 1.234 may be a thousand; a bad cell hides that."""
    frame = measured()
    frame["force_N"] = [str(567 + place) for place in range(len(frame))]
    frame.loc[row(2, 3), "force_N"] = "1.234"
    frame.loc[row(5, 3), "force_N"] = "abc"
    left_out = read_fleet(frame, skip_bad=True).case.left_out
    assert set(left_out) == {"G2", "G5"}
    assert "thousand" in left_out["G2"].problem


def test_gears_that_never_moved_are_left_out_too():
    frame = measured()
    frame.loc[frame["gear"] == "G2", "deformation_mm"] = 0.3
    frame = frame.drop(range(row(5, 1), row(6, 0))).reset_index(drop=True)
    readings = read_fleet(frame)
    words = told(usable, readings)
    assert [one.count("gear 'G") for one in words] == [1, 1, 0]
    assert "2 of 8 gears are bad: 'G2', 'G5'" in words[-1]
    found, ratio = usable(readings, skip_bad=True)
    same(found, read_fleet(without(frame, "G2", "G5")))
    assert ratio.tolist() == [1.0] * 6


def test_gears_without_a_size_or_with_an_impossible_one_are_left_out():
    walls = 0.68 * np.linspace(0.9, 1.1, GEARS)
    sizes = pd.DataFrame(
        {"gear": [f"G{gear}" for gear in range(GEARS)], "wall_thickness_mm": walls}
    )
    sizes["wall_thickness_mm"] = sizes["wall_thickness_mm"].astype(object)
    sizes.loc[1, "wall_thickness_mm"] = "thin"
    sizes.loc[3, "wall_thickness_mm"] = 50.0
    sizes = pd.concat([sizes.drop(index=6), sizes.iloc[[4]]])
    readings = read_fleet(measured(), SIZES)
    words = told(usable, readings, sizes)
    assert "4 of 8 gears are bad: 'G1', 'G3', 'G4' and 1 more" in words[-1]
    assert sum("skip_bad" in one for one in words) == 1
    found, ratio = usable(readings, sizes, skip_bad=True)
    same(found, read_fleet(without(measured(), "G1", "G3", "G4", "G6"), SIZES))
    assert ratio == pytest.approx((walls[[0, 2, 5, 7]] / 0.68) ** 3)
    assert "has a row already" in found.case.left_out["G4"].problem
    assert "has no row" in found.case.left_out["G6"].problem


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"force_N": "force_furlong"}, "unknown unit"),
        ({"force_N": "other"}, "no column holds the force"),
    ],
)
def test_what_is_wrong_with_a_file_stops_all(spoiled, change, words):
    assert any(
        words in one
        for one in told(read_fleet, spoiled.rename(columns=change), skip_bad=True)
    )


def test_rows_of_nobody_and_lines_that_do_not_fit_stop_all(spoiled, tmp_path):
    spoiled.loc[row(7, 3), "gear"] = ""
    (first,) = told(read_fleet, spoiled, skip_bad=True)
    assert "the specimen label is empty" in first
    text = measured().to_csv(index=False).replace("\nG7,1,0.5,", "\nG7,1,")
    (tmp_path / "line.csv").write_text(text)
    words = told(read_fleet, tmp_path / "line.csv", skip_bad=True)
    assert any("has 3 cells where the header row has 4" in one for one in words)


def test_a_size_table_that_cannot_be_read_stops_all():
    readings = read_fleet(measured(), SIZES)
    given = pd.DataFrame({"gear": ["G0"], "radius [mm]": [40.0]})
    words = told(usable, readings, given, skip_bad=True)
    assert any("it states no sizes" in one for one in words)


def test_fewer_than_three_that_are_left_are_refused():
    frame = measured()
    for gear in range(2, GEARS):
        frame.loc[row(gear, 1), "force_N"] = "abc"
    words = told(api.fleet, frame, skip_bad=True)
    assert "of 8 gears 2 can be used" in words[-1]
    assert sum("'abc' is not a number" in one for one in words) == 6
    # Nor is anything left where every gear is bad.
    frame["force_N"] = "abc"
    words = told(api.fleet, frame, skip_bad=True)
    assert not any("skip_bad" in one for one in words)


@pytest.fixture
def saved(tmp_path):
    """Parquet in two files, with a bad cell beyond the first rows and one in them."""
    frame = measured().infer_objects()
    frame.loc[row(0, 3), "force_N"] = np.nan
    frame.loc[row(6, 2), "force_N"] = 1e30
    folder = tmp_path / "line"
    folder.mkdir()
    half = row(4, 0)
    frame[:half].to_parquet(folder / "a.parquet", index=False)
    frame[half:].to_parquet(folder / "b.parquet", index=False)
    return folder, frame


@pytest.mark.parametrize("shown", [40, row(6, 10), 10_000])
@pytest.mark.parametrize("batch", [7, 50, 1 << 18])
def test_of_parquet_they_are_left_out_wherever_they_stand(
    saved, monkeypatch, shown, batch
):
    folder, frame = saved
    whole = without(frame, "G0", "G6")
    whole.to_parquet(folder.parent / "whole.parquet", index=False)
    monkeypatch.setattr(pool, "_SHOWN", shown)
    monkeypatch.setattr(parquet, "_BATCH", batch)
    found = read_fleet(folder, skip_bad=True)
    same(found, read_fleet(folder.parent / "whole.parquet"))
    why = found.case.left_out
    assert set(why) == {"G0", "G6"}
    assert why["G0"].file.endswith("a.parquet") and why["G0"].row == 4
    assert why["G6"].file.endswith("b.parquet") and why["G6"].row == row(2, 2) + 1


@pytest.mark.parametrize("shown", [40, 10_000])
def test_parquet_stops_otherwise_and_offers_it_once(saved, monkeypatch, shown):
    monkeypatch.setattr(pool, "_SHOWN", shown)
    words = told(read_fleet, saved[0])
    assert sum("skip_bad" in one for one in words) == 1
    assert words[-1].startswith("skip_bad") and "'G0'" in words[-1]


def test_a_row_of_nobody_stops_parquet(saved, monkeypatch):
    folder, frame = saved
    monkeypatch.setattr(pool, "_SHOWN", 40)
    frame.loc[row(7, 2), "gear"] = None
    frame.to_parquet(folder / "b.parquet", index=False)
    words = told(read_fleet, folder, skip_bad=True)
    assert any("label is empty" in one for one in words)


def test_the_command_says_which_are_left_out(here: Hdcal, spoiled, tmp_path):
    spoiled.loc[spoiled["gear"] == "G3", "deformation_mm"] = 0.3
    spoiled.to_csv(tmp_path / "line.csv", index=False)
    lines = [f"{name} = {value}" for name, value in SIZES.items()]
    (tmp_path / "gear.toml").write_text("\n".join(["[gear]", *lines]))
    given = "fleet", "line.csv", "--out", "out"
    refused = here(*given)
    assert refused.returncode == 2 and not (tmp_path / "out").exists()
    assert refused.stderr.count("--skip-bad") == 1
    done = here(*given, "--skip-bad")
    assert done.returncode == 0, done.stderr
    answer = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))
    obeys(answer, FleetAnswer)
    assert answer["gears"] == 4
    assert [one["gear"] for one in answer["left_out"]] == ["G1", "G4", "G6", "G3"]
    table = pd.read_csv(tmp_path / "out" / "gears.csv")
    assert len(table) == 8
    out = table[table["status"] != "ok"].set_index("gear")
    assert list(out.index) == ["G1", "G4", "G6", "G3"]
    assert out.drop(columns="status").isna().all(axis=None)


def test_how_far_gears_were_moved_is_that_of_those_that_are_left(saved):
    frame = measured().infer_objects()
    still = frame["gear"] == "G3"
    frame.loc[still, "deformation_mm"] = 5.0
    found, _ = usable(read_fleet(frame, skip_bad=True), skip_bad=True)
    assert set(found.case.left_out) == {"G3"} and found.largest == 0.5


def test_lots_of_parquet_are_those_of_gears_that_are_left(saved, monkeypatch):
    folder, frame = saved
    frame["lot"] = np.where(frame["gear"].isin(["G1", "G2"]), "A", "B")
    # A bad gear of two lots beyond the first rows.
    frame.loc[row(6, 5), "lot"] = "A"
    half = row(4, 0)
    frame[:half].to_parquet(folder / "a.parquet", index=False)
    frame[half:].to_parquet(folder / "b.parquet", index=False)
    monkeypatch.setattr(pool, "_SHOWN", 40)
    found = read_fleet(folder, skip_bad=True).case
    told = dict(zip(found.specimen_labels, found.lots, strict=True))
    assert told == {g: "A" if g in ("G1", "G2") else "B" for g in found.specimen_labels}
    assert not any("lots are not used" in note for note in found.notes)
