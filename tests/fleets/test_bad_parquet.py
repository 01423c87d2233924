"""Gears of Parquet that are bad are found wherever their rows stand."""

import numpy as np
import pandas as pd
import pytest

from hdcal.data.measurements import parquet
from hdcal.errors import InputError
from hdcal.fleets import pool
from hdcal.fleets.read_fleet import read_fleet

GEARS, RUNS, ROWS = 9, 2, 20
SIZES = {"wall_thickness_mm": 0.68, "radius_mm": 40.0, "length_mm": 70.0}


def measured() -> pd.DataFrame:
    """Return forty rows each of G0, G1, …."""
    rng = np.random.default_rng(3)
    rows = GEARS * RUNS * ROWS
    x = np.tile(np.linspace(0.05, 0.5, ROWS), GEARS * RUNS)
    return pd.DataFrame(
        {
            "serial": np.repeat([f"G{gear}" for gear in range(GEARS)], RUNS * ROWS),
            "run": np.tile(np.repeat(range(RUNS), ROWS), GEARS),
            "deformation_um": 1000.0 * x,
            "force_N": 200.0 * x + rng.normal(0.0, 0.2, rows),
            "time_s": np.arange(float(rows)),
        }
    )


def told(*args, **kwargs) -> list[str]:
    with pytest.raises(InputError) as caught:
        read_fleet(*args, **kwargs)
    return [str(finding) for finding in caught.value.findings]


@pytest.mark.parametrize("batch", [30, 1 << 18])
def test_no_row_lies_beyond_the_radius(tmp_path, monkeypatch, batch):
    """As in a table, of which the farthest row of each gear is told."""
    monkeypatch.setattr(pool, "_SHOWN", 40)
    monkeypatch.setattr(parquet, "_BATCH", batch)
    given = measured()
    given.loc[[204, 207, 290], "deformation_um"] = [41_000.0, -45_000.0, 40_000.0]
    given.loc[291, "deformation_um"] = 1e30  # which is wrong with any radius
    given.to_parquet(tmp_path / "line.parquet", index=False)
    words = told(tmp_path / "line.parquet", SIZES)
    where = "line.parquet, row 208, column 'deformation_um'"
    said = "a deformation of 45 mm on a radius of 40 mm"
    assert any(where in one and said in one for one in words)
    assert "'G5'" in words[-1] and words[-1].startswith("skip_bad")
    if batch > len(given):
        assert sum("on a radius" in one for one in words) == 2
        assert sum("row 291" in one for one in words) == 1
    found = read_fleet(tmp_path / "line.parquet", SIZES, skip_bad=True)
    assert set(found.case.left_out) == {"G5", "G7"}
    # Of a spring no radius is known.
    given.loc[291, "deformation_um"] = 0.0
    given.to_parquet(tmp_path / "line.parquet", index=False)
    assert not read_fleet(tmp_path / "line.parquet").case.left_out


@pytest.mark.parametrize("problem", ["the cell is empty", "goes back within"])
@pytest.mark.parametrize("batch", [30, 1 << 18])
def test_all_first_rows_of_parquet_may_be_of_a_bad_gear(
    tmp_path, monkeypatch, problem, batch
):
    """Of the others the first rows are looked at then, and kept."""
    frame = measured()
    whole = frame[~frame["serial"].isin(["G0", "G5"])]
    frame.loc[205, "force_N"] = np.nan
    if problem == "the cell is empty":
        frame.loc[3, "force_N"] = np.nan
    else:
        frame.loc[3, "time_s"] = -1.0
    # Rows of the bad one among the others change no place.
    frame = pd.concat([frame[2:40], frame[:2], frame[40:]], ignore_index=True)
    (folder := tmp_path / "line").mkdir()
    frame[:30].to_parquet(folder / "a.parquet", index=False)
    frame[30:].to_parquet(folder / "b.parquet", index=False)
    monkeypatch.setattr(pool, "_SHOWN", 20)
    monkeypatch.setattr(parquet, "_BATCH", batch)
    (first, *_) = told(folder)
    assert problem in first and "a.parquet, row 2" in first
    found = read_fleet(folder, skip_bad=True)
    why = found.case.left_out
    assert set(why) == {"G0", "G5"}
    assert problem in why["G0"].problem and why["G0"].row == 2
    assert why["G5"].file.endswith("b.parquet") and why["G5"].row == 205 + 1 - 30
    whole.to_parquet(tmp_path / "whole.parquet", index=False)
    other = read_fleet(tmp_path / "whole.parquet")
    assert found.case.specimen_labels == other.case.specimen_labels
    assert found.sums.xy == pytest.approx(other.sums.xy, rel=1e-12)
    for name in ("force", "specimen", "run"):
        mine, theirs = (getattr(one.case.records, name) for one in (found, other))
        assert len(mine) and np.array_equal(mine, theirs[: len(mine)]), name
    # Nobody else's rows are there to look at.
    frame[frame["serial"] == "G0"].to_parquet(tmp_path / "one.parquet", index=False)
    assert any(problem in one for one in told(tmp_path / "one.parquet"))
