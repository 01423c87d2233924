"""A fleet without a column `run` is that of its dates, rigs and operators."""

import numpy as np
import pandas as pd
import pytest

import hdcal as api
from hdcal.data.measurements import parquet
from hdcal.fleets import pool
from hdcal.fleets.read_fleet import read_fleet

GEARS, ROWS = 8, 8
TOLD = "without a column `run`"


@pytest.fixture(scope="module")
def frame() -> pd.DataFrame:
    """Return readings of gears, every other one on two dates by two rigs."""
    rng = np.random.default_rng(8)
    x = np.linspace(0.05, 0.5, ROWS)
    parts = []
    for gear in range(GEARS):
        stiffness = 200.0 * (1.0 + 0.005 * rng.standard_normal())
        for run, rig in enumerate(["south", "north"][: 2 - gear % 2]):
            force = stiffness * (1.02 - 0.04 * run) * x + rng.normal(0.0, 1.0)
            about = {"specimen": f"G{gear}", "rig": rig, "operator": "KM"[gear % 2]}
            about |= {"date": f"2026-10-{gear + 1 + 10 * run:02d}"}
            force += rng.normal(0.0, 0.2, ROWS)
            parts.append(pd.DataFrame(about | {"deformation_mm": x, "force_N": force}))
    return pd.concat(parts, ignore_index=True)


def with_runs(frame: pd.DataFrame) -> pd.DataFrame:
    return frame.assign(run=frame["specimen"] + "-" + frame["date"])


def same(found, told) -> None:
    """Check that what was read without a column `run` is what was read with one."""
    for name, value in vars(told.sums).items():
        assert getattr(found.sums, name) == pytest.approx(value, rel=1e-12), name
    assert found.runs.tolist() == told.runs.tolist()
    case, other = found.case, told.case
    assert np.array_equal(case.records.run, other.records.run)
    assert (case.specimen_labels, case.rigs) == (other.specimen_labels, other.rigs)
    assert [date[:10] for date in case.dates] == [date[:10] for date in other.dates]
    (note,) = (note for note in case.notes if TOLD in note)
    assert "12 mountings of 8 gears." in note
    assert not any(TOLD in note for note in other.notes)


def test_readings_are_those_of_a_column_run(frame):
    same(read_fleet(frame), read_fleet(with_runs(frame)))


@pytest.mark.parametrize("batch", [5, 1 << 18])
def test_batches_of_parquet_tell_the_same(frame, tmp_path, monkeypatch, batch):
    monkeypatch.setattr(parquet, "_BATCH", batch)
    told = read_fleet(with_runs(frame))
    seconds = pd.to_timedelta(frame.index, unit="s")
    stamped = frame.assign(date=pd.to_datetime(frame["date"]) + seconds)
    for table in (frame, stamped):
        table.to_parquet(tmp_path / "line.parquet", index=False)
        same(read_fleet(tmp_path / "line.parquet"), told)


def test_the_first_rows_of_parquet_have_their_runs(frame, tmp_path, monkeypatch):
    monkeypatch.setattr(pool, "_SHOWN", 3 * ROWS)
    bad = frame.copy()
    bad.loc[bad["specimen"] == "G1", "force_N"] = np.nan
    bad.to_parquet(tmp_path / "line.parquet", index=False)
    found = read_fleet(tmp_path / "line.parquet", skip_bad=True)
    assert found.case.records.run.tolist() == np.repeat([0, 1, 2], ROWS).tolist()
    assert found.case.run_labels[:2] == ("2026-10-01 south", "2026-10-11 north")
    assert len(found.case.run_labels) == 11 and [*found.case.left_out] == ["G1"]


def test_parquet_of_files_fills_empty_cells(frame, tmp_path):
    (tmp_path / "line").mkdir()
    given = frame.copy()
    given.loc[3, "rig"] = None
    for part, rows in enumerate([given.iloc[:4], given.iloc[4:]]):
        rows.to_parquet(tmp_path / "line" / f"{part}.parquet", index=False)
    same(read_fleet(tmp_path / "line"), read_fleet(with_runs(frame)))


def test_parquet_of_one_mounting_each_is_as_before(frame, tmp_path):
    once = frame[frame["rig"] == "south"]
    once.to_parquet(tmp_path / "line.parquet", index=False)
    case = read_fleet(tmp_path / "line.parquet").case
    assert case.run_labels == case.specimen_labels
    assert not any(TOLD in note for note in case.notes)


@pytest.mark.parametrize("named", [False, True])
def test_files_of_gears_tell_the_same(frame, tmp_path, named):
    folder = tmp_path / "line"
    folder.mkdir()
    for gear, rows in frame.groupby("specimen"):
        rows = rows if named else rows.drop(columns="specimen")
        rows.to_csv(folder / f"{gear}.csv", index=False)
    same(read_fleet(folder), read_fleet(with_runs(frame)))
    if not named:
        case = api.read_case(folder, specimen="G0")
        assert case.run_labels == ("2026-10-01 south", "2026-10-11 north")


def test_inches_and_pounds_in_parquet_are_converted(frame, tmp_path):
    names = {"deformation_mm": "deformation_in", "force_N": "force_lbf"}
    frame.rename(columns=names).to_parquet(tmp_path / "line.parquet", index=False)
    found, told = read_fleet(tmp_path / "line.parquet"), read_fleet(frame)
    assert found.sums.x == pytest.approx(25.4 * told.sums.x, rel=1e-12)
    assert found.sums.y == pytest.approx(4.4482216152605 * told.sums.y, rel=1e-12)
    assert found.largest == pytest.approx(12.7)


@pytest.mark.parametrize("bad", [False, True])
def test_clocks_may_restart_in_each_mounting_of_a_parquet_file(frame, tmp_path, bad):
    """Also beside a gear that is left out; and nothing goes back within a run."""
    rows = frame.assign(time_s=np.tile(np.arange(float(ROWS)), len(frame) // ROWS))
    rows.loc[3, "force_N"] = np.nan if bad else rows.loc[3, "force_N"]
    rows.to_parquet(tmp_path / "line.parquet")
    found = read_fleet(tmp_path / "line.parquet", skip_bad=True)
    told = read_fleet(rows, skip_bad=True)
    assert [*found.case.left_out] == ["G0"] * bad
    assert len(found.sums.gear) == len(told.sums.gear) == 12 - 2 * bad
    assert not any("goes back" in note for note in found.case.notes)
