"""A fault in the record of one gear: the gear is named, or left out whole."""

import numpy as np
import pandas as pd
import pytest
from gear_records import records, refused
from gear_rows import ordinary

from hdcal.fleets.reading.read_fleet import read_fleet, usable
from hdcal.fleets.reading.readings import RowSums, reading_vectors
from hdcal.fleets.reading.record_faults import faults_among_gears, irregular

ODD = "G3"


def jump(x, force):
    force[20:] += 15.0


def broken(x, force):
    force[24:] *= 0.3


def kilonewtons(x, force):
    force /= 1000.0


def stuck(x, force):
    force[18:] = force[18]


def stuck_gauge(x, force):
    x[18:] = x[18]


def at_zero(x, force):
    x[:] = 0.0


def dead(x, force):
    force[:] = 0.1


def opposite(x, force):
    force *= -1.0


def one_place(x, force):
    x[:] = 0.3


FAULTS = [
    (jump, "jump of the force"),
    (broken, "permanent drop of the force"),
    (kilonewtons, "stiffness is 1/10"),
    (stuck, "do not follow a smooth curve"),
    (stuck_gauge, "do not follow a smooth curve"),
    (dead, "does not grow"),
    (opposite, "falls as the deformation grows"),
    (one_place, "one deformation only"),
    (at_zero, "one deformation only"),
]


def spoiled(spoil, loop: float) -> pd.DataFrame:
    frame = records(runs=1, rows=60, loop=loop)
    rows = frame["gear"] == ODD
    columns = [
        frame.loc[rows, name].to_numpy() for name in ("deformation_mm", "force_N")
    ]
    columns = [column.copy() for column in columns]
    spoil(*columns)
    frame.loc[rows, "deformation_mm"], frame.loc[rows, "force_N"] = columns
    return frame


@pytest.mark.parametrize("source", ["table", "Parquet"])
@pytest.mark.parametrize(("spoil", "words"), FAULTS)
def test_a_fault_is_named_and_its_gear_left_out_whole(spoil, words, source, tmp_path):
    frame = spoiled(spoil, 0.0 if source == "table" else 1.0)
    data = frame
    if source == "Parquet":
        data = tmp_path / "line.parquet"
        frame.to_parquet(data, index=False)
    found = read_fleet(data)
    first, offer = refused(usable, found)
    assert f"gear '{ODD}': " in first and words in first
    assert offer.startswith("skip_bad: 1 of 8 gears is faulty: 'G3'")
    left = usable(found, skip_bad=True)
    assert [*left.case.left_out] == [ODD]
    sound = frame[frame["gear"] != ODD]
    whole = usable(read_fleet(sound))
    # Noise of all gears together decides on the branch of a turning row.
    kept = [0, 2, 3]
    for name in ("mean", "products"):
        mine, theirs = (getattr(each.sums, name)[..., kept] for each in (left, whole))
        mine, theirs = (m if name == "mean" else m[:, kept] for m in (mine, theirs))
        assert mine == pytest.approx(theirs, rel=1e-9, abs=1e-9), name


def test_without_a_fault_no_gear_is_left_out_and_noise_alone_is_none():
    frame = records(gears=20, rows=60, loop=1.0)
    noisy = frame["gear"] == ODD
    rng = np.random.default_rng(1)
    frame.loc[noisy, "force_N"] += rng.normal(0.0, 2.0, noisy.sum())
    softer = frame["gear"] == "G5"
    frame.loc[softer, "force_N"] *= 0.5
    assert not usable(read_fleet(frame)).case.left_out


def test_a_repaired_record_stays_with_a_note_that_names_the_gear(tmp_path):
    frame = records(runs=1, rows=60)
    frame.loc[np.flatnonzero(frame["gear"] == ODD)[12], "force_N"] += 40.0
    frame.to_parquet(tmp_path / "line.parquet", index=False)
    for data in (frame, tmp_path / "line.parquet"):
        found = usable(read_fleet(data))
        (note,) = (note for note in found.case.notes if "outliers" in note)
        assert f"gear '{ODD}'" in note
        assert found.sums.rows.tolist() == [60.0] * 3 + [59.0] + [60.0] * 4


def test_a_fault_shows_among_gears_whose_noise_is_correlated(tmp_path):
    frame, rng = records(runs=1, rows=80), np.random.default_rng(3)
    for rows in frame.groupby("gear").groups.values():
        drift = np.zeros(80)
        for row in range(1, 80):
            drift[row] = 0.8 * drift[row - 1] + rng.normal(0.0, 0.3)
        frame.loc[rows, "force_N"] += drift
    late = (frame["gear"] == ODD) & (frame.groupby("gear").cumcount() >= 40)
    frame.loc[late, "force_N"] += 15.0
    frame.to_parquet(tmp_path / "line.parquet", index=False)
    for data in (frame, tmp_path / "line.parquet"):
        found = usable(read_fleet(data), skip_bad=True)
        assert {*found.case.left_out} == {ODD}
        assert found.sums.rows.tolist() == [80.0] * 7


def test_what_most_gears_show_is_of_the_test():
    frame = records(runs=1, rows=60)
    late = frame.groupby("gear").cumcount() >= 40
    late &= frame["gear"].isin([f"G{gear}" for gear in range(5)])
    frame.loc[late, "force_N"] += 30.0
    found = usable(read_fleet(frame))
    assert not found.case.left_out and len(found.sums.rows) == 8 + 5


def test_fewer_than_three_that_are_left_are_refused():
    frame = records(gears=4, runs=1, rows=60)
    frame.loc[frame["gear"] == "G0", "force_N"] *= -1.0
    assert len(usable(read_fleet(frame), skip_bad=True).sums.gear) == 3
    frame.loc[frame["gear"] == "G2", "force_N"] *= -1.0
    words = refused(usable, read_fleet(frame), skip_bad=True)
    assert "2 of 4 gears can be used" in words[-1] and len(words) == 3


@pytest.mark.parametrize(
    ("gears", "scatter", "apart", "found"),
    [
        (10, 0.0, 0.05, True),
        (10, 0.003, 0.2, True),
        (100, 0.003, 0.1, True),
        (100, 0.003, 0.0, False),
        (10, 0.0, 0.005, False),
    ],
)
def test_two_parts_under_one_label(gears, scatter, apart, found):
    hits = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        rows = ordinary(gears, rng)
        gain = scatter * rng.standard_normal((gears, 2))
        gain[2, 1] += apart
        rows.gain, rows.noise = gain, rows.noise / 3.0
        bad = faults_among_gears(rows.readings(rng))
        hits += [*bad] == ["G2"] if found else not bad
    assert hits >= 19


def test_gains_of_rigs_are_no_two_parts():
    rng = np.random.default_rng(5)
    rows = ordinary(12, rng)
    rows.gain = np.tile([0.0, 0.3], (12, 1))
    rows.labels = {"rigs": ["A", "B"] * 12}
    assert not faults_among_gears(rows.readings(rng))
    rows.gain[2] = rows.gain[2, ::-1]
    assert [*faults_among_gears(rows.readings(rng))] == ["G2"]


def test_regular_records_fail_as_rarely_as_stated():
    rng = np.random.default_rng(2)
    x, sense = np.linspace(0.02, 0.5, 60), np.ones(60)
    records_, index = 4000, np.repeat(np.arange(4000), 60)

    def share(error) -> float:
        force = (200.0 * x + 3.0 * x**2 + error).ravel()
        v = reading_vectors(np.tile(x, records_), np.tile(sense, records_), force)
        return irregular(RowSums.of(index, v, v[0]), v, index).mean()

    noise = rng.normal(0.0, 0.2, (records_, 60))
    assert share(noise) < 0.006
    step = np.where(np.arange(60) >= 30, 1.5, 0.0)
    assert share(noise + step) > 0.99
    wild = noise.copy()
    wild[:, 17] += 1.5
    assert share(wild) > 0.99
