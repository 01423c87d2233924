"""Long records are shortened so that what is left can still be weighed."""

import numpy as np
import pytest
from rigs import cycles, make_case

from hdcal.evidence.fewer_rows import average_rows, thin_rows
from hdcal.evidence.row_features import half_cycles

CASE = make_case(cycles(144))


@pytest.mark.parametrize("step", [2, 3, 7])
def test_one_row_of_so_many_of_each_half_cycle_is_kept(step):
    half = half_cycles(CASE.records)
    kept = [
        row for each in np.unique(half) for row in np.flatnonzero(half == each)[::step]
    ]
    thinned = thin_rows(CASE, step).records
    np.testing.assert_array_equal(thinned.force, CASE.records.force[kept])
    np.testing.assert_array_equal(thinned.sense, CASE.records.sense[kept])


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
