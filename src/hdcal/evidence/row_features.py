"""Features of ordered rows; fewer rows of long records; the step of coarse forces."""

from dataclasses import replace

import jax
import numpy as np
from jaxtyping import Float

from hdcal.data.case import Case
from hdcal.data.records import Records
from hdcal.inference.force_model.noise_form import pilot_fit

# A grid matters from one noise sd on: below, rounding adds less than a tenth to the
# variance. Rounding to a step scatters by step/√12: much wider than the noise, forces
# were set and not read.
_LEAST, _MOST = 1.0, 1.5 * np.sqrt(12.0)
# Forces lie on a grid where none is farther from it than this share of its step.
_OFF = 0.05
# Fits of the grid, and growth of the range of each.
_FITS, _GROWTH = 8, 8.0


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
    turned = np.diff(run, prepend=run[0]) != 0
    return np.cumsum(turned | (np.diff(sense, prepend=sense[0]) != 0))


def half_cycle_rows(records: Records) -> float:
    """Return the median number of rows of a half cycle."""
    return float(np.median(np.bincount(half_cycles(records))))


def cosines(x: Float[np.ndarray, " n"], count: int) -> Float[np.ndarray, "k n"]:
    """Return cosines of 1, 2, … half waves over a covariate from −1 to 1."""
    return np.cos(np.pi * np.arange(1, count + 1)[:, None] * (x + 1.0) / 2.0)


def tolerance_functions(records: Records) -> Float[np.ndarray, "j n"]:
    """Return smooth functions by which the shape of an effect may deviate.

    Their mean squares sum to one, so that a coefficient's prior sd is the relative sd
    of the shape at a typical row.
    """
    table = np.concatenate(
        [
            cosines(scale_to_unit(records.deformation), 3),
            cosines(place_in_run(records.run), 2),
            np.asarray(records.sense, float)[None],
            scale_to_unit(records.temperature)[None],
            scale_to_unit(np.abs(records.rate))[None],
        ]
    )
    return table / np.sqrt(np.sum(np.mean(table**2, axis=1)))


def thin_rows(case: Case, most: int, *, turns: bool = False) -> Case:
    """Return the case with evenly spaced rows of each run, some `most` in all.

    A thinned AR(1) series is AR(1) with its coefficient to the power of the step; means
    of neighbours are not. With `turns` rows are counted from the turns of the path on,
    which are then kept, unless half cycles are hardly longer than the step.
    """
    step = -(-len(case.records.force) // most)
    if step == 1:
        return case
    order = np.argsort(np.asarray(case.records.run), kind="stable")
    records = take_rows(case.records, order)
    turns &= half_cycle_rows(records) >= 2 * step
    label = half_cycles(records) if turns else np.asarray(records.run)
    last = np.diff(label, append=label[-1] + 1) != 0
    rows, begins = np.arange(len(label)), np.diff(label, prepend=label[0] - 1) != 0
    place = rows - np.maximum.accumulate(np.where(begins, rows, 0))
    kept = np.flatnonzero((place % step == 0) | (turns & last))
    return replace(case, records=take_rows(records, kept))


def with_coarse_step(case: Case) -> Case:
    """Return the case with the step of its force reading in its gear, if it is coarse.

    That readings are coarse is a fact of the record. As a hypothesis it would compete
    with those on the mean reading, and explains none of it.
    """
    if case.gear.force_resolution > 0.0:
        return case
    noise_sd = pilot_fit(case.records).noise_sd
    step = _grid_step(np.asarray(case.records.force, float), noise_sd)
    if not _LEAST * noise_sd <= step <= _MOST * noise_sd:
        return case
    return replace(case, gear=replace(case.gear, force_resolution=step))


def coarse_step(case: Case, noise_sd: float) -> float:
    """Return the stated step of the force reading where it matters [N], else 0."""
    step = case.gear.force_resolution
    return step if step >= _LEAST * noise_sd else 0.0


def _grid_step(force: Float[np.ndarray, " n"], noise_sd: float) -> float:
    """Return the step of the grid on which all forces lie, 0 without one."""
    values = np.unique(force)
    gaps = np.diff(values)
    gaps = gaps[gaps > _OFF * noise_sd]
    if len(gaps) < 2:
        return 0.0
    step, zero = float(gaps.min()), 0.0
    # A step that is a little wrong miscounts far values: near ones improve it first.
    for reach in _GROWTH ** np.arange(1, _FITS + 1):
        near = values[values <= values[0] + reach * step]
        counts = np.round((near - values[0]) / step)
        if counts[-1] >= 2.0 and len(near) > 2:
            step, zero = map(float, np.polyfit(counts, near, 1))
    off = np.abs(values - zero - step * np.round((values - zero) / step))
    return step if off.max() <= _OFF * step else 0.0
