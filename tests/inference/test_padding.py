"""Rows are padded to few lengths, and what is padded is as before where it was."""

import numpy as np
import pytest

from hdcal.inference.padding import (
    append_zeros,
    bucket_size,
    measured,
    repeat_last_row,
)


def test_few_lengths_hold_every_number_of_rows() -> None:
    sizes = [bucket_size(rows) for rows in range(1, 3000)]
    assert all(size >= rows for rows, size in enumerate(sizes, start=1))
    assert all(size < 1.5 * rows for rows, size in enumerate(sizes, 1) if rows > 16)
    assert sorted(set(sizes)) == sizes_up_to(3072)
    assert bucket_size(0) == 16
    assert bucket_size(1_000_000) == 2**20


def sizes_up_to(largest: int) -> list[int]:
    powers = [2**k for k in range(4, 13)]
    every = sorted([*powers, *(3 * power // 2 for power in powers)])
    return [size for size in every if size <= largest]


def test_a_length_of_a_bucket_is_its_own() -> None:
    for size in sizes_up_to(5000):
        assert bucket_size(size) == size


@pytest.mark.parametrize("pad", [repeat_last_row, append_zeros])
def test_measured_rows_stay_and_the_others_are_told_apart(pad) -> None:
    tree = {"a": np.arange(5.0), "b": np.arange(10).reshape(5, 2), "c": np.ones(5, int)}
    padded = pad(tree, 16)
    real = np.asarray(measured(16, 5))
    assert real.sum() == 5
    for name, array in tree.items():
        assert padded[name].dtype == array.dtype
        assert padded[name].shape == (16, *array.shape[1:])
        np.testing.assert_array_equal(padded[name][real], array)
        rest = array[-1:] if pad is repeat_last_row else np.zeros_like(array[:1])
        np.testing.assert_array_equal(padded[name][~real], np.repeat(rest, 11, axis=0))


def test_a_full_bucket_is_left_as_it_is() -> None:
    rows = np.arange(24.0)
    np.testing.assert_array_equal(append_zeros(rows, 24), rows)
    np.testing.assert_array_equal(repeat_last_row(rows, 24), rows)
