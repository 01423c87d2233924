"""Features of ordered rows: place in a run, half cycles, blocks to leave out."""

import jax
import numpy as np

from hdcal.data.records import Records


def take_rows(records: Records, rows) -> Records:
    """Return some rows of the records; what is known of them stays the same."""
    return jax.tree.map(lambda column: np.asarray(column)[rows], records)


def scale_to_unit(values) -> np.ndarray:
    """Return values scaled to −1 … 1; zeros where they are all the same."""
    values = np.asarray(values, float)
    low, high = values.min(), values.max()
    return (2.0 * values - low - high) / (high - low) if high > low else 0.0 * values


def place_in_run(run) -> np.ndarray:
    """Return the place of each row in its run, −1 … 1; runs are contiguous."""
    run = np.asarray(run)
    place = np.zeros(len(run))
    for rows in np.split(np.arange(len(run)), np.flatnonzero(np.diff(run)) + 1):
        place[rows] = np.linspace(-1.0, 1.0, len(rows)) if len(rows) > 1 else 0.0
    return place


def half_cycles(records: Records) -> np.ndarray:
    """Return the index of the half cycle of each row, new with each run."""
    run, sense = np.asarray(records.run), np.asarray(records.sense)
    turned = (np.diff(run, prepend=run[0]) != 0) | (
        np.diff(sense, prepend=sense[0]) != 0
    )
    return np.cumsum(turned)


def half_cycle_blocks(records: Records, fewest: int = 4) -> np.ndarray:
    """Return the index of the block of each row: half cycles, else equal stretches.

    Args:
        records: rows, run after run.
        fewest: number of half cycles below which all rows are cut into stretches.
    """
    halves = half_cycles(records)
    if halves[-1] + 1 >= fewest:
        return halves
    rows = len(halves)
    count = int(np.clip(rows // 3, 2, 6))
    return np.minimum(np.arange(rows) * count // rows, count - 1)
