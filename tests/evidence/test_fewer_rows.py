"""Long records are shortened so that what is left can still be weighed."""

from dataclasses import replace

import numpy as np
import pytest
from rigs import cycles, make_case, make_records

from hdcal.data.loading import derive_motion
from hdcal.evidence.fewer_rows import (
    average_rows,
    rows_of_half_cycle,
    thin_rows,
)
from hdcal.evidence.row_features import half_cycles, take_rows

CASE = make_case(cycles(144))
OF_THREE_RUNS = make_case(replace(CASE.records, run=np.arange(144) // 48))


@pytest.mark.parametrize("step", [2, 3, 7])
def test_as_many_rows_lie_between_any_two_of_a_run_that_are_left(step):
    run = np.asarray(OF_THREE_RUNS.records.run)
    kept = [k for each in np.unique(run) for k in np.flatnonzero(run == each)[::step]]
    thinned = thin_rows(OF_THREE_RUNS, step).records
    np.testing.assert_array_equal(thinned.force, CASE.records.force[kept])
    np.testing.assert_array_equal(thinned.sense, CASE.records.sense[kept])


def test_rows_of_runs_that_alternate_are_thinned_run_by_run():
    one_by_one = np.argsort(np.arange(144) % 48, kind="stable")
    mixed = make_case(take_rows(OF_THREE_RUNS.records, one_by_one))
    thinned, plain = (thin_rows(case, 5).records for case in (mixed, OF_THREE_RUNS))
    np.testing.assert_array_equal(thinned.force, plain.force)


@pytest.mark.parametrize("step", [2, 7, 40])
def test_single_rows_keep_the_turns(step):
    """Where rows are counted past the turns, tops are lost."""
    whole, kept = (
        OF_THREE_RUNS.records,
        thin_rows(OF_THREE_RUNS, step, turns=True).records,
    )
    assert len(kept.force) < len(whole.force)
    for run in range(3):
        ends = [
            (np.min(at), np.max(at))
            for records in (whole, kept)
            for at in [np.asarray(records.deformation)[records.run == run]]
        ]
        assert ends[0] == ends[1]
    assert set(np.asarray(kept.force)) <= set(np.asarray(whole.force))
    assert np.max(thin_rows(OF_THREE_RUNS, 40).records.deformation) < 0.54


def ramps(*rows: int) -> np.ndarray:
    """Return a path over one range, up and down in turn, in so many rows each."""
    ends = [(0.0, 0.5), (0.5, 0.0)]
    return np.concatenate(
        [np.linspace(*ends[k % 2], n + 1)[1:] for k, n in enumerate(rows)]
    )


@pytest.mark.parametrize(
    ("path", "rows"),
    [
        (ramps(*[10] * 24, 400, 400), 400),
        (ramps(*[300] * 6, *[12] * 4), 300),
        # Much is read where nothing is moved: that shows no loop.
        (np.concatenate([ramps(*[40] * 10), np.linspace(0.0, 0.01, 8000)[1:]]), 40),
    ],
)
def test_most_rows_lie_in_half_cycles_as_long_as(path, rows):
    motion = derive_motion(path, np.zeros(len(path), int))
    moved = {name: getattr(motion, name) for name in ("direction", "sense", "rate")}
    records = make_records(path, 100.0 * path, known=motion.features, **moved)
    assert rows_of_half_cycle(make_case(records)) == pytest.approx(rows, abs=2)


def test_means_are_those_of_the_rows_from_one_kept_row_to_the_next():
    half = half_cycles(CASE.records)
    means = [
        np.mean(CASE.records.force[rows[at : at + 3]])
        for each in np.unique(half)
        for rows in [np.flatnonzero(half == each)]
        for at in range(0, len(rows), 3)
    ]
    averaged, group = average_rows(CASE, 48)
    assert group == 3
    np.testing.assert_allclose(averaged.records.force, means)


def test_nothing_is_left_out_where_nothing_is_asked():
    assert thin_rows(CASE, 1) is CASE
    assert average_rows(CASE, 144) == (CASE, 1)
