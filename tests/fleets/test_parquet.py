"""Parquet in batches comes to the same as all rows at once."""

import json
import os
import signal

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from commands import Hdcal
from pyarrow import dataset as tables
from pyarrow import parquet as pq

import hdcal as api
from hdcal.data.measurements import parquet
from hdcal.data.tables.parquet_files import is_parquet
from hdcal.errors import InputError
from hdcal.fleets import pool
from hdcal.fleets.pool import Pool
from hdcal.fleets.read_fleet import read_fleet

GEARS, RUNS, ROWS = 12, 2, 20
# Each shape of a fleet is compiled by itself: answers are those of one without groups,
# of as many gears as in other tests.
GROUPS = ["lot", "operator", "rig"]


@pytest.fixture(scope="module")
def frame():
    rng = np.random.default_rng(3)
    x = np.linspace(0.05, 0.5, ROWS)
    parts = [
        pd.DataFrame(
            {
                "serial": f"G{gear}",
                "run": run,
                "lot": "AB"[gear % 2],
                "operator": ["Kim", "Ada", "Bo"][(gear + run) % 3],
                "rig": f"R{run}",
                "date": f"2026-04-{gear + 1:02d}",
                "deformation_um": 1000.0 * x,
                "force_N": 200.0 * x * (1 + 0.01 * rng.standard_normal())
                + rng.normal(0.0, 0.5)
                + rng.normal(0.0, 0.2, ROWS),
                "temperature_C": 20.0 + gear,
            }
        )
        for gear in range(GEARS)
        for run in range(RUNS)
    ]
    return pd.concat(parts, ignore_index=True)


def same(found, whole):
    """Check that what was read in batches is what was read at once."""
    gears = [whole.case.specimen_labels.index(g) for g in found.case.specimen_labels]
    each = {(whole.sums.gear[m], whole.runs[m]): m for m in range(len(whole.runs))}
    names = [*whole.case.run_labels]
    order = []
    for mounting, gear in enumerate(found.sums.gear):
        label = found.case.run_labels[found.runs[mounting]]
        order.append(each[gears[gear], names.index(label)])
    for name in ("rows", "x", "y", "xx", "xy", "yy", "operator", "rig"):
        one, other = getattr(found.sums, name), getattr(whole.sums, name)[order]
        assert one == pytest.approx(other, rel=1e-12), name
    assert [found.case.lots[g] for g in range(len(gears))] == [
        whole.case.lots[g] for g in gears
    ]
    for one, other in (("operators", 0), ("rigs", 0), ("dates", 10)):
        mine = [getattr(found.case, one)[r][: other or None] for r in found.runs]
        theirs = [
            getattr(whole.case, one)[whole.runs[m]][: other or None] for m in order
        ]
        assert mine == theirs
    assert found.largest == whole.largest


@pytest.mark.parametrize("batch", [7, 100, 1 << 18])
@pytest.mark.parametrize("shuffled", [False, True])
def test_batches_come_to_what_all_rows_come_to(
    frame, tmp_path, monkeypatch, batch, shuffled
):
    monkeypatch.setattr(parquet, "_BATCH", batch)
    given = frame.sample(frac=1.0, random_state=1) if shuffled else frame
    given.to_parquet(tmp_path / "line.parquet", index=False)
    found = read_fleet(tmp_path / "line.parquet")
    same(found, read_fleet(frame))
    assert found.case.name == "line"


def test_of_many_rows_the_first_are_kept(frame, tmp_path, monkeypatch):
    monkeypatch.setattr(pool, "_SHOWN", 50)
    frame.to_parquet(tmp_path / "line.parquet", index=False)
    found = read_fleet(tmp_path / "line.parquet")
    assert len(found.case.records.force) == 50
    same(found, read_fleet(frame))


def test_a_folder_may_be_partitioned(frame, tmp_path):
    table = pa.Table.from_pandas(frame, preserve_index=False)
    kinds = pa.schema([("lot", pa.string()), ("serial", pa.string())])
    split = tables.partitioning(kinds, flavor="hive")
    folder = tmp_path / "line"
    tables.write_dataset(table, folder, format="parquet", partitioning=split)
    (folder / "gear.toml").write_text("[gear]\ntheory = 'spring'\n")
    found = read_fleet(folder)
    same(found, read_fleet(frame))
    assert found.case.name == "line"
    # Which file holds what does not matter to the answer.
    assert is_parquet(folder) and not is_parquet(tmp_path / "none")


def test_labels_may_be_numbers_categories_and_times(frame, tmp_path):
    table = frame.assign(
        serial=frame["serial"].str[1:].astype(int),
        operator=frame["operator"].astype("category"),
        date=pd.to_datetime(frame["date"]) + pd.to_timedelta(frame.index, unit="s"),
    )
    table.to_parquet(tmp_path / "line.parquet", index=False)
    found = read_fleet(tmp_path / "line.parquet")
    same(found, read_fleet(frame.assign(serial=frame["serial"].str[1:])))


def test_the_answer_is_that_of_a_table(frame, tmp_path):
    frame = frame.drop(columns=GROUPS)
    frame.to_parquet(tmp_path / "line.parquet", index=False)
    one, other = (api.fleet(data) for data in (frame, tmp_path / "line.parquet"))
    assert np.median(one.stiffness) == pytest.approx(np.median(other.stiffness))
    assert one.called.tolist() == other.called.tolist()


def wrong(path):
    with pytest.raises(InputError) as caught:
        read_fleet(path)
    return "\n".join(map(str, caught.value.findings))


def test_a_cell_that_is_no_reading_is_named_with_its_row(frame, tmp_path, monkeypatch):
    monkeypatch.setattr(pool, "_SHOWN", 40)
    given = frame.copy()
    given.loc[200, "force_N"] = np.nan
    given.loc[201, "force_N"] = 1e30
    given.loc[202, "serial"] = None
    given.to_parquet(tmp_path / "line.parquet", index=False)
    told = wrong(tmp_path / "line.parquet")
    assert "row 201" in told and "empty" in told
    assert "row 202" in told and "row 203" in told
    assert "line.parquet" in told


def test_files_of_several_kinds_are_refused(frame, tmp_path):
    frame.to_parquet(tmp_path / "a.parquet", index=False)
    frame.assign(force_N=frame["force_N"].astype(str)).to_parquet(
        tmp_path / "b.parquet", index=False
    )
    told = wrong(tmp_path)
    assert "'force_N'" in told and "b.parquet" in told
    frame.drop(columns="force_N").to_parquet(tmp_path / "b.parquet", index=False)
    told = wrong(tmp_path)
    assert "b.parquet" in told and "the cell is empty" in told


def test_columns_that_are_not_used_may_be_of_any_kind(frame, tmp_path):
    """As pandas saves an empty column, and one that holds lists."""
    lists = [[1.0, 2.0]] * len(frame)
    frame.assign(remark=None, trace=lists).to_parquet(tmp_path / "a.parquet")
    other = frame.assign(serial="H" + frame["serial"], remark="late", trace="none")
    other.to_parquet(tmp_path / "b.parquet")
    assert len(read_fleet(tmp_path).case.specimen_labels) == 2 * GEARS


def test_serials_of_folders_keep_their_noughts(frame, tmp_path):
    names = ["0012", "12", "A3", "007", "7"]
    for place, name in enumerate(names):
        folder = tmp_path / f"serial={name}"
        folder.mkdir()
        part = frame[frame["serial"] == f"G{place}"].drop(columns="serial")
        part.to_parquet(folder / "part.parquet", index=False)
    assert sorted(read_fleet(tmp_path).case.specimen_labels) == sorted(names)


def test_a_folder_of_another_table_is_no_parquet(frame, tmp_path):
    frame.to_csv(tmp_path / "data.csv", index=False)
    (tmp_path / "results").mkdir()
    frame.to_parquet(tmp_path / "results" / "old.parquet")
    assert not is_parquet(tmp_path)


def test_labels_with_gaps_are_those_of_a_table(frame, tmp_path, monkeypatch):
    monkeypatch.setattr(parquet, "_BATCH", 100)
    lot = frame["lot"].map({"A": 1, "B": 2}).astype("Int64")
    lot[5] = pd.NA
    frame.assign(lot=lot).to_parquet(tmp_path / "line.parquet", index=False)
    assert set(read_fleet(tmp_path / "line.parquet").case.lots) == {"1", "2"}
    given = frame.copy()
    given.loc[300, "serial"] = ""
    given.to_parquet(tmp_path / "line.parquet", index=False)
    monkeypatch.setattr(pool, "_SHOWN", 100)
    assert "row 301" in wrong(tmp_path / "line.parquet")


@pytest.mark.parametrize("zone", [None, "Europe/Berlin", "Asia/Tokyo"])
def test_a_day_is_that_of_the_clock_on_the_wall(frame, tmp_path, zone):
    times = pd.to_datetime(frame["date"]) + pd.to_timedelta(1, unit="h")
    frame.assign(date=times.dt.tz_localize(zone)).to_parquet(tmp_path / "l.parquet")
    found = read_fleet(tmp_path / "l.parquet").case.dates
    assert found[0][:10] == "2026-04-01"


def test_a_fault_of_the_first_rows_is_told_with_its_file(frame, tmp_path):
    frame.to_parquet(tmp_path / "a.parquet", index=False)
    given = frame.copy()
    given.loc[4, "force_N"] = np.nan
    given.to_parquet(tmp_path / "b.parquet", index=False)
    told = wrong(tmp_path)
    assert "b.parquet, row 5" in told


def test_what_is_no_parquet_inside_is_refused(tmp_path):
    (tmp_path / "line.parquet").write_bytes(b"PAR1 and nothing else")
    assert "no Parquet file that can be read" in wrong(tmp_path / "line.parquet")


def test_without_gears_or_numbers_it_is_refused(frame, tmp_path):
    frame.drop(columns="serial").to_parquet(tmp_path / "line.parquet", index=False)
    assert "which gear" in wrong(tmp_path / "line.parquet")
    pq.write_table(pa.table({"serial": ["a"] * 6}), tmp_path / "line.parquet")
    assert "deformation" in wrong(tmp_path / "line.parquet")


@pytest.mark.thorough
def test_the_command_reads_it(frame, here: Hdcal, tmp_path):
    frame.to_parquet(tmp_path / "line.parquet", index=False)
    done = here("fleet", "line.parquet", "--out", "out")
    assert done.returncode == 0, done.stderr
    answer = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))
    assert answer["rows"] == GEARS * RUNS * ROWS
    assert len(answer["lots"]) == 2


@pytest.mark.thorough
def test_a_cluster_leaves_out_the_same_gears(frame, tmp_path, local, monkeypatch):
    monkeypatch.setattr(pool, "_SHOWN", 40)
    given = frame.copy()
    given.loc[[200, 300], "force_N"] = np.nan
    for gear, part in given.groupby("serial"):
        part.to_parquet(tmp_path / f"{gear}.parquet", index=False)
    alone = read_fleet(tmp_path, skip_bad=True)
    address = local.scheduler_address
    together = read_fleet(tmp_path, skip_bad=True, scheduler=address)
    assert set(alone.case.left_out) == {"G5", "G7"}
    assert together.case.left_out == alone.case.left_out
    assert together.case.specimen_labels == alone.case.specimen_labels
    assert np.array_equal(together.sums.xy, alone.sums.xy)


@pytest.mark.thorough
def test_a_cluster_whose_worker_is_killed_reads_the_same(
    frame, tmp_path, local, monkeypatch
):
    for gear, part in frame.groupby("serial"):
        part.to_parquet(tmp_path / f"{gear}.parquet", index=False)
    alone, killed, join = read_fleet(tmp_path), [], Pool.join

    def kill_and_join(pool, other):
        if not killed:
            process = local.workers[0].process
            killed.append(process.pid)
            os.kill(process.pid, signal.SIGKILL)
        join(pool, other)

    monkeypatch.setattr(Pool, "join", kill_and_join)
    together = read_fleet(tmp_path, scheduler=local.scheduler_address)
    assert killed
    for name in ("gear", "rows", "x", "y", "xx", "xy", "yy", "operator"):
        one, other = getattr(together.sums, name), getattr(alone.sums, name)
        assert np.array_equal(one, other), name
    assert together.case.specimen_labels == alone.case.specimen_labels
    assert together.case.run_labels == alone.case.run_labels
    assert together.case.data_sha256 == alone.case.data_sha256


def test_of_many_gears_those_since_a_day_may_be_none_of_the_first(
    frame, tmp_path, monkeypatch
):
    monkeypatch.setattr(pool, "_SHOWN", 2 * RUNS * ROWS)
    frame = frame.drop(columns=GROUPS)
    frame.to_parquet(tmp_path / "line.parquet", index=False)
    found = api.fleet(tmp_path / "line.parquet", since="2026-04-03")
    assert len(found.off) == GEARS - 2
    assert not len(found.case.records.force)
    assert found.misfit.correlation == 0.0
    again = api.fleet(frame[frame["date"] >= "2026-04-03"])
    assert np.median(found.stiffness) == pytest.approx(np.median(again.stiffness), 1e-3)


def test_a_scheduler_reads_no_table(frame):
    with pytest.raises(InputError, match="no Parquet"):
        read_fleet(frame, scheduler="tcp://127.0.0.1:1")


@pytest.mark.parametrize("batch", [90, 1 << 18])
def test_rows_are_screened_as_those_of_a_table(tmp_path, monkeypatch, batch):
    monkeypatch.setattr(parquet, "_BATCH", batch)
    rng = np.random.default_rng(5)
    x, gears, rows = np.linspace(0.0, 1.0, 60), 4, 60
    table = pd.DataFrame({"serial": np.repeat([f"G{g}" for g in range(gears)], rows)})
    table["deformation_mm"] = np.tile(x, gears)
    force = 100.0 * table["deformation_mm"] + rng.normal(0.0, 0.1, gears * rows)
    force[70] += 60.0
    force[2 * rows + 30 : 3 * rows] -= 40.0
    table = table.assign(lot="A", operator="Kim", rig="R", date="2026-04-01")
    table.assign(force_N=force).to_parquet(tmp_path / "line.parquet", index=False)
    found = read_fleet(tmp_path / "line.parquet")
    whole = read_fleet(table.assign(force_N=force))
    assert len(found.runs) == len(whole.runs) == gears + 1
    same(found, whole)
    assert np.bincount(found.sums.gear, found.sums.rows).tolist() == [60, 59, 60, 60]
    part = read_fleet(tmp_path / "line.parquet", range="0.2:0.8")
    assert part.case.records.deformation.max() <= 0.8
    same(part, read_fleet(table.assign(force_N=force), range="0.2:0.8"))


@pytest.mark.parametrize("batch", [60, 1 << 18])
def test_a_gear_of_opposite_sign_is_asked_about_or_left_out(
    tmp_path, monkeypatch, batch
):
    monkeypatch.setattr(parquet, "_BATCH", batch)
    rng = np.random.default_rng(5)
    x = np.tile(np.linspace(0.0, 1.0, 60), 4)
    table = pd.DataFrame({"serial": np.repeat(["A", "B", "C", "D"], 60)})
    sign = np.where(table["serial"] == "B", -1.0, 1.0)
    force = 100.0 * sign * x + rng.normal(0.0, 0.1, len(x))
    table = table.assign(deformation_mm=x, force_N=force)
    table.to_parquet(tmp_path / "line.parquet", index=False)
    assert "'B'" in wrong(tmp_path / "line.parquet")
    found = read_fleet(tmp_path / "line.parquet", skip_bad=True)
    assert set(found.case.left_out) == {"B"}
    assert np.all(found.sums.xy > 0.0) and len(found.runs) == 3
