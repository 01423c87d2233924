"""Readings of many gears are the same from a table, files, and Parquet in batches."""

import os
import signal

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from gear_records import SIZES, records, refused, same
from pyarrow import dataset as tables

from hdcal.data.loading import derive_motion
from hdcal.data.measurements import parquet
from hdcal.data.reading import read_case
from hdcal.fleets.reading import parquet_readings
from hdcal.fleets.reading.parquet_readings import BatchSums, senses
from hdcal.fleets.reading.read_fleet import read_fleet, usable
from hdcal.fleets.reading.readings import RowSums, reading_vectors
from hdcal.inference.distributions import moments


def labelled(**how) -> pd.DataFrame:
    """Return records with lots, operators, rigs, dates and temperatures."""
    frame = records(**how)
    gear, run = frame["gear"].str[1:].astype(int), frame["run"]
    return frame.assign(
        lot=np.where(gear % 2, "B", "A"),
        operator=np.array(["Kim", "Ada", "Bo"])[(gear + run) % 3],
        rig="R" + run.astype(str),
        date=[f"2026-04-{day + 1:02d}" for day in gear],
        temperature_C=20.0 + gear,
    )


def test_sums_are_those_of_all_rows_and_of_joined_parts():
    rng = np.random.default_rng(0)
    index, part = np.sort(rng.integers(0, 5, 300)), np.sort(rng.integers(0, 40, 300))
    x, sense, y = rng.normal(0.0, 1.0, (3, 300))
    v = reading_vectors(x, sense, y)
    whole = RowSums.of(index, v, x)
    for k in range(5):
        about = v[:, index == k] - v[:, index == k].mean(axis=1, keepdims=True)
        assert whole.products[k] == pytest.approx(about @ about.T)
        assert whole.lagged[k] == pytest.approx(about[:, 1:] @ about[:, :-1].T)
    assert v[2] == pytest.approx(np.sign(x) * x**2)
    (of_part, _), place = np.unique([index, part], axis=1, return_inverse=True)
    joined = RowSums.of(place, v, x).joined(of_part)
    for name, theirs in vars(whole).items():
        assert getattr(joined, name) == pytest.approx(theirs), name


def test_sums_count_the_modulus_and_mirror_gears_that_were_pulled():
    frame = labelled(gears=4, loop=1.0)
    pressed = read_fleet(frame, SIZES)
    pulled = frame.assign(
        deformation_mm=-frame["deformation_mm"], force_N=-frame["force_N"]
    )
    found = read_fleet(pulled, SIZES)
    assert (found.side, found.largest) == (-1, -pressed.largest)
    for name in ("mean", "products", "lagged"):
        mine, theirs = (getattr(each.sums, name) for each in (found, pressed))
        assert mine == pytest.approx(theirs, rel=1e-9, abs=1e-9)
    loss, _ = moments(pressed.case.gear.priors["alpha"])
    left = 1.0 - loss * np.arange(4)
    ratio = pressed.sums.mean[::2, 0] / pressed.sums.mean[0, 0]
    assert ratio == pytest.approx(left / left[0], rel=1e-9)
    sized = pressed.at_one_size(np.array([1.0, 2.0, 1.0, 1.0]))
    moment = sized.sums.products[2] / pressed.sums.products[2]
    assert moment[0, 0] == pytest.approx(4.0) and moment[0, 2] == pytest.approx(8.0)
    assert sized.largest == pressed.largest


@pytest.mark.parametrize("mixed", [False, True])
@pytest.mark.parametrize("batch", [7, 1 << 18])
def test_batches_come_to_what_all_rows_come_to(tmp_path, monkeypatch, batch, mixed):
    monkeypatch.setattr(parquet, "_BATCH", batch)
    monkeypatch.setattr(parquet_readings, "_SHOWN", 50)
    frame = labelled(gears=6)
    if mixed:  # Rows of the gears alternate, those of a mounting keep their order.
        place = frame.groupby(["gear", "run"]).cumcount()
        frame = frame.iloc[np.argsort(place, kind="stable")].reset_index(drop=True)
    frame.to_parquet(tmp_path / "line.parquet", index=False)
    found = read_fleet(tmp_path / "line.parquet", SIZES)
    assert found.case.name == "line" and len(found.case.records.force) == 50
    by_gear = frame.sort_values("gear", kind="stable", ignore_index=True)
    whole = read_fleet(by_gear, SIZES)
    if mixed:
        names = "rows", "mean", "products", "lagged", "reach"
        for name in names:
            mine, theirs = (getattr(each.sums, name) for each in (found, whole))
            assert mine == pytest.approx(theirs, rel=1e-9, abs=1e-9)
        return
    same(found, whole)
    for name in ("force", "deformation", "run", "specimen"):
        mine, theirs = (getattr(each.case.records, name) for each in (found, whole))
        assert np.array_equal(mine, theirs[:50]), name


def test_senses_are_those_of_derive_motion():
    rng = np.random.default_rng(1)
    up, down = np.linspace(0.02, 0.5, 30), np.linspace(0.49, 0.03, 25)
    kinds = [up, np.r_[up, down], np.r_[up, up], np.r_[up, down, up + 1e-3, down], -up]
    kinds += [np.linspace(0.0, 0.5, 90) + rng.normal(0.0, 0.02, 90), np.full(6, 0.3)]
    kinds += [up[:1]]
    index = np.repeat(np.arange(len(kinds)), [len(each) for each in kinds])
    x, order = np.concatenate(kinds), np.argsort(rng.random(len(index)), kind="stable")
    mixed = index[order]
    values = np.empty(len(x))
    for k, each in enumerate(kinds):
        values[mixed == k] = each
    for value, of in ((x, index), (values, mixed)):
        assert np.array_equal(senses(value, of), derive_motion(value, of).sense)


def test_folders_may_be_partitioned_and_labels_of_any_kind(tmp_path):
    frame = labelled().rename(columns={"gear": "serial"})
    frame["serial"] = frame["serial"].replace({"G0": "007", "G1": "7"})
    whole = read_fleet(frame)
    table = pa.Table.from_pandas(frame, preserve_index=False)
    kinds = pa.schema([("serial", pa.string())])
    split = tables.partitioning(kinds, flavor="hive")
    tables.write_dataset(table, tmp_path / "a", format="parquet", partitioning=split)
    found = read_fleet(tmp_path / "a")
    assert sorted(found.case.specimen_labels) == sorted(whole.case.specimen_labels)
    assert np.sort(found.sums.products, axis=0) == pytest.approx(
        np.sort(whole.sums.products, axis=0)
    )
    other = frame.assign(
        operator=frame["operator"].astype("category"),
        lot=frame["lot"].map({"A": 1, "B": 2}).astype("Int64").where(frame.index != 5),
        date=pd.to_datetime(frame["date"]).dt.tz_localize("Asia/Tokyo")
        + pd.to_timedelta(frame.index, unit="s"),
        remark=[None, "late"] * (len(frame) // 2),
        trace=[[1.0, 2.0]] * len(frame),
    )
    other.to_parquet(tmp_path / "b.parquet", index=False)
    case = read_fleet(tmp_path / "b.parquet").case
    assert {*case.lots} == {"1", "2"} and case.operators == whole.case.operators
    days = [[date[:10] for date in each.dates] for each in (case, whole.case)]
    assert days[0] == days[1]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"force_N": np.nan}, "row 31"),
        ({"gear": None}, "label is empty"),
        ({"deformation_mm": 45.0}, "'45 mm' is impossible at a radius of 40 mm"),
    ],
)
@pytest.mark.parametrize("batch", [30, 1 << 18])
def test_a_faulty_cell_names_its_gear_and_file(
    tmp_path, monkeypatch, change, words, batch
):
    monkeypatch.setattr(parquet, "_BATCH", batch)
    frame = records()
    for name, value in change.items():
        frame.loc[[30, 33], name] = value
    half = len(frame) // 2
    frame[:half].to_parquet(tmp_path / "a.parquet", index=False)
    frame[half:].to_parquet(tmp_path / "b.parquet", index=False)
    if "gear" in change:
        assert words in refused(read_fleet, tmp_path, SIZES)[0]
        return
    readings = read_fleet(tmp_path, SIZES)
    first, *_, last = refused(usable, readings)
    assert words in first and "a.parquet" in first and "'G0'" in first
    assert last.startswith("skip_bad")
    found = usable(readings, skip_bad=True)
    same(found, usable(read_fleet(records().query("gear != 'G0'"), SIZES)))
    table = usable(read_fleet(frame, SIZES), skip_bad=True)
    assert table.case.left_out["G0"].row in (32, 35)


def test_files_that_are_no_table_of_gears_are_refused(tmp_path):
    frame, path = records(), tmp_path / "line.parquet"
    path.write_bytes(b"PAR1 and nothing else")
    assert "not a readable Parquet file" in refused(read_fleet, path)[0]
    frame.drop(columns="gear").to_parquet(path, index=False)
    assert "names the gear" in refused(read_fleet, path)[0]
    frame.assign(force_N="a").to_parquet(tmp_path / "other.parquet", index=False)
    frame.to_parquet(path, index=False)
    assert "other.parquet" in refused(read_fleet, tmp_path)[0]
    assert refused(read_fleet, frame, scheduler="tcp://127.0.0.1:1")


@pytest.mark.parametrize("batch", [90, 1 << 18])
def test_rows_are_screened_as_those_of_a_table(tmp_path, monkeypatch, batch):
    monkeypatch.setattr(parquet, "_BATCH", batch)
    frame, rng = records(gears=5, runs=1, rows=60), np.random.default_rng(6)
    frame.loc[70, "force_N"] += 60.0
    frame.loc[150:179, "force_N"] -= 40.0
    frame.loc[240:299, "deformation_mm"] += rng.normal(0.0, 0.02, 60)
    frame.to_parquet(tmp_path / "line.parquet", index=False)
    for how in ({}, {"range": "0.1:0.4"}):
        found = read_fleet(tmp_path / "line.parquet", **how)
        whole = read_fleet(frame, **how)
        same(found, whole)
        assert {*found.faults} == {*whole.faults} == {"G2"}
    assert len(whole.sums.rows) == 6 and whole.case.records.deformation.max() <= 0.4


@pytest.mark.thorough
def test_a_cluster_reads_the_same_though_a_worker_is_killed(
    tmp_path, local, monkeypatch
):
    frame = labelled()
    frame.loc[[10, 11], "force_N"] = np.nan
    for gear, part in frame.groupby("gear"):
        part.to_parquet(tmp_path / f"{gear}.parquet", index=False)
    alone, killed, join = read_fleet(tmp_path), [], BatchSums.join

    def kill_and_join(sums, other):
        if not killed:
            killed.append(local.workers[0].process.pid)
            os.kill(killed[0], signal.SIGKILL)
        join(sums, other)

    monkeypatch.setattr(BatchSums, "join", kill_and_join)
    together = read_fleet(tmp_path, scheduler=local.scheduler_address)
    assert killed and together.faults == alone.faults
    same(together, alone)
    assert together.case.data_sha256 == alone.case.data_sha256


def write_gear(folder, text="", **sizes) -> None:
    lines = [f"{name} = {value!r}" for name, value in (SIZES | sizes).items()]
    (folder / "gear.toml").write_text("\n".join(["[gear]", *lines, text]), "utf-8")


def test_a_file_for_each_gear(tmp_path):
    frame = labelled(gears=6)
    folder = tmp_path / "line"
    folder.mkdir()
    for gear, part in frame.groupby("gear"):
        part.drop(columns="gear").to_csv(folder / f"{gear}.csv", index=False)
    write_gear(folder)
    whole = read_fleet(frame, SIZES)
    same(read_fleet(folder), whole)
    # Files of other kinds, with other headers and units.
    part = frame[frame["gear"] == "G0"].drop(columns="gear")
    (folder / "G0.csv").unlink()
    part = part.assign(force_N=part["force_N"] / 1000.0)
    part.rename(columns={"force_N": "Load [kN]"}).to_excel(folder / "G0.xlsx")
    (folder / "remarks.txt").write_text("measured on a Friday\n")
    found = read_fleet(folder)
    assert found.sums.products == pytest.approx(whole.sums.products, rel=1e-6, abs=1e-9)
    assert any("remarks.txt" in note for note in found.case.notes)
    alone = read_case(folder, specimen="G1").records.force
    assert np.array_equal(alone, read_case(folder / "G1.csv").records.force)
    # A file that cannot be read, and one with a faulty cell.
    (folder / "G5.csv").write_text("")
    lines = (folder / "G4.csv").read_text("utf-8").splitlines()
    cells = lines[3].split(",")
    cells[2] = "abc"
    lines[3] = ",".join(cells)
    (folder / "G4.csv").write_text("\n".join(lines))
    words = refused(usable, read_fleet(folder))
    assert "'abc'" in "".join(words) and "2 of 6 gears are faulty" in words[-1]
    found = usable(read_fleet(folder), skip_bad=True)
    assert found.case.specimen_labels == ("G0", "G1", "G2", "G3")
    assert found.case.left_out["G4"].row == 4


def test_a_folder_for_each_gear_states_its_sizes(tmp_path):
    frame = records(gears=6)
    folder = tmp_path / "line"
    for place, (gear, part) in enumerate(frame.groupby("gear")):
        (folder / str(gear)).mkdir(parents=True)
        part.drop(columns="gear").to_csv(folder / str(gear) / "data.csv", index=False)
        write_gear(folder / str(gear), wall_thickness_mm=0.68 * 1.05**place)
    readings = read_fleet(folder)
    same(readings, read_fleet(frame, SIZES))
    found = usable(readings)
    assert found.size_ratio == pytest.approx(1.05 ** (3.0 * np.arange(6)))
    assert found.sums.products[6, 0, 0] == pytest.approx(
        readings.sums.products[6, 0, 0] * 1.05**18
    )
    base = usable(read_fleet(folder, folder / "G2" / "gear.toml"))
    assert base.size_ratio == pytest.approx(1.05 ** (3.0 * np.arange(-2, 4)))
    table = {"specimen": ["G0"], "length_mm": [70.0]}
    assert "gears" in refused(usable, readings, table)[0]
    write_gear(folder / "G2", 'theory = "cup"')
    assert "G2" in refused(usable, read_fleet(folder))[0]
    assert {*usable(read_fleet(folder), skip_bad=True).case.left_out} == {"G2"}
    frame.to_csv(folder / "G1.csv", index=False)
    assert any("folders of gears" in words for words in refused(read_fleet, folder))


def test_a_gear_with_a_fault_in_one_file_is_left_out_of_all(tmp_path):
    frame = records(gears=5).astype({"force_N": object})
    for run, part in frame.groupby("run"):
        part = part.drop(columns="run").reset_index(drop=True)
        part.loc[2, "force_N"] = "abc" if run else part.loc[2, "force_N"]
        part.to_csv(tmp_path / f"F{run}.csv", index=False)
    found = usable(read_fleet(tmp_path, SIZES), skip_bad=True)
    assert found.case.specimen_labels == ("G1", "G2", "G3", "G4")
    assert {*found.case.left_out} == {"G0"}
    # Of a file that cannot be read nobody knows which gears it held.
    (tmp_path / "F2.csv").write_text("nothing\n")
    assert all("F2.csv" in words for words in refused(read_fleet, tmp_path, SIZES))


def test_shipped_priors_are_shares_of_the_readings_that_are_left():
    frame = labelled(gears=6)
    other = frame["gear"] == "G1"
    assert other.any()
    mixed = frame.assign(force_N=frame["force_N"] * np.where(other, 1000.0, 1.0))
    left = usable(read_fleet(mixed, SIZES), skip_bad=True)
    assert [*left.case.left_out] == ["G1"]
    alone = usable(read_fleet(frame[~other], SIZES))
    scale = left.case.gear.full_scale
    assert scale == alone.case.gear.full_scale and scale.force < 1000.0
