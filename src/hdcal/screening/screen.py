"""Screening of a record, run by run, before any model is fitted."""

from itertools import pairwise
from typing import Literal

import numpy as np

from hdcal.screening.branches import name_segments, straight_part
from hdcal.screening.channels import HIDDEN
from hdcal.screening.ends import rows_after_drop
from hdcal.screening.result import DROPPED, Screening
from hdcal.screening.run import Run, look_at
from hdcal.screening.turning_points import rows_of_runs, turning_points
from hdcal.screening.wild import FEWEST
from hdcal.screening.working_range import WorkingRange

Sign = Literal["same", "opposite", "unclear", "unknown"]
_BRANCH = 0.2  # a movement over this share of the range is a branch of the curve
# Rank correlation from which on force and deformation surely go together, and the
# standard errors beyond which it is no chance.
_CLEAR = 0.9
_CHANCE = 3.5
# From more rows on the scatter of the deformation shows, and is looked for.
_MOST_ROWS = 40
# What the residuals of a line with independent noise rarely exceed: the largest one,
# in sd, and the correlation of each with the next one, in its standard errors.
_LARGEST, _CORRELATED = 2.8, 2.0
_NOISE = 0.05  # share of the range of the force that is noise at most
_FEWEST_FOR_SIGN = 5  # rows that show the sign of a slope


def screen(
    deformation: np.ndarray,
    force: np.ndarray,
    run: np.ndarray | None = None,
    *,
    whole: bool = True,
    wanted: WorkingRange | None = None,
) -> Screening:
    """Find what of a record is no curve of a part, and deal with it.

    Args:
        deformation: as read [mm], in the order it was taken, shape (n,).
        force: as read [N].
        run: index of the mounting; by default one.
        whole: whether these are all runs. Of some of them nobody knows whether the sign
            is opposite in every run, so that it is asked about and not turned.
        wanted: working range. Where force and deformation grow together in it, the sign
            is the usual one.
    """
    x, y = np.array(deformation, float), np.array(force, float)
    n = x.size
    index = np.zeros(n, int) if run is None else np.asarray(run)
    runs = []
    plain = plain_runs(x, y, index)
    for rows in rows_of_runs(index):
        one = Run.of(rows, x, y, int(index[rows[0]]))
        one.plain = bool(plain[one.index])
        look_at(one)
        runs.append(one)
    _signs(runs, wanted, whole=whole)
    for one in runs:
        name_segments(one)
    return _gathered(runs, n)


def _gathered(runs: list[Run], n: int) -> Screening:
    columns = {name: np.zeros(n) for name in ("x", "y", "segment", "kept", "zero")}
    for one in runs:
        for name, values in columns.items():
            values[one.rows] = getattr(one, name)
    scatter = max((one.scatter for one in runs), default=0.0)
    span = max((float(np.ptp(one.x)) for one in runs), default=0.0)
    return Screening(
        tuple(found for one in runs for found in one.observations),
        columns["segment"].astype(int),
        columns["kept"].astype(bool),
        columns["x"],
        columns["y"],
        columns["zero"].astype(int),
        scatter,
        10.0 * scatter > HIDDEN * span,
        straight_part(runs[0], n) if len(runs) == 1 else None,
    )


def _signs(runs: list[Run], wanted: WorkingRange | None, *, whole: bool) -> None:
    """Turn the force where it is counted the other way in every run.

    What comes after the largest force is cut first: there the force falls.
    """
    signs = [_sign(one, wanted) for one in runs]
    turned = whole and {*signs} - {"unknown"} == {"opposite"}
    for one, sign in zip(runs, signs, strict=True):
        if sign == "same" or (sign == "unknown" and not turned):
            continue
        rows = np.flatnonzero(one.kept)
        x, y = one.x[rows], one.y[rows]
        slope = float(np.polyfit(x - x.mean(), y - y.mean(), 1)[0])
        if turned:
            one.y = -one.y
            one.observe("opposite sign", rows, slope, "N/mm", "turned")
        else:
            one.observe("negative slope", rows, slope, "N/mm", "asked")


def _sign(one: Run, wanted: WorkingRange | None) -> Sign:
    """Tell how force and deformation go together until the force has dropped."""
    rows = one.distinct()
    if rows.size < _FEWEST_FOR_SIGN:
        return "unknown"
    if one.plain:
        return "same"
    x, y = one.x[rows], one.y[rows]
    sign = sign_of_slope(x, y, one.scatter)
    if rows.size < FEWEST:
        return sign
    inside = _inside(wanted, x, y)
    for way, expected in ((1.0, "same"), (-1.0, "opposite")):
        stated = expected == "opposite" and not inside.all()
        if stated and sign_of_slope(x[inside], y[inside], one.scatter) == "same":
            return "same"
        found = rows_after_drop(x, way * y)
        if found is None or inside[: found[0]].sum() < _FEWEST_FOR_SIGN:
            continue
        first, drop = found
        before = sign_of_slope(x[:first], y[:first], one.scatter)
        if before == expected:
            after = np.flatnonzero(one.kept & (np.arange(one.x.size) >= rows[first]))
            one.cut(after, DROPPED)
            one.observe("after the largest force", after, way * drop, "N", "cut")
            return before
    return sign


def _inside(wanted: WorkingRange | None, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Tell which rows lie within stated deformations; all where hardly one does."""
    if wanted is not None and wanted.unit == "mm":
        inside = wanted.inside(x, y)
        if inside.sum() >= _FEWEST_FOR_SIGN:
            return inside
    return np.ones(x.size, bool)


def sign_of_slope(x: np.ndarray, y: np.ndarray, scatter: float = 0.0) -> Sign:
    """Tell whether force and deformation grow together.

    Opposite: the force falls all along every branch, loading and unloading, as it does
    when one channel is counted the other way. Unclear: it falls in the mean only.
    """
    together = _rank_correlation(x, y)
    if together >= 0.0:
        return "same"
    turns, _ = turning_points(x, max(_BRANCH * float(np.ptp(x)), 10.0 * scatter))
    ends = [0, *turns.tolist(), x.size - 1]
    branches = [
        _rank_correlation(x[first : last + 1], y[first : last + 1])
        for first, last in pairwise(ends)
        if last - first >= 4
    ]
    if branches and max(branches) < -_CLEAR:
        return "opposite"
    return "unclear" if together * np.sqrt(x.size - 1.0) < -_CHANCE else "same"


def _rank_correlation(x: np.ndarray, y: np.ndarray) -> float:
    step = max(1, x.size // 5000)
    if min(np.ptp(x), np.ptp(y)) == 0.0:
        return 0.0
    ranks = np.array([np.argsort(np.argsort(each[::step])) for each in (x, y)])
    return float(np.corrcoef(ranks[0], ranks[1])[0, 1])


def plain_runs(x: np.ndarray, y: np.ndarray, run: np.ndarray) -> np.ndarray:
    """Tell which runs, by index, are short, straight and rising with white noise."""
    order = np.argsort(run, kind="stable")
    x, y, run = x[order], y[order], run[order]
    rows = np.bincount(run)
    with np.errstate(all="ignore"):
        x = x - (np.bincount(run, x) / rows)[run]
        y = y - (np.bincount(run, y) / rows)[run]
        slope = np.bincount(run, x * y) / np.bincount(run, x * x)
        left = y - slope[run] * x
        squares = np.bincount(run, left * left)
        sd = np.sqrt(squares / rows)
        largest = np.zeros(rows.size)
        np.maximum.at(largest, run, np.abs(left))
        same = np.diff(run) == 0
        pairs = np.bincount(run[1:][same], (left[1:] * left[:-1])[same], rows.size)
        correlation = np.abs(pairs / squares) * np.sqrt(rows)
        noise = sd / np.sqrt(np.bincount(run, y * y) / rows)
    plain = (rows < _MOST_ROWS) & (slope > 0.0) & (noise < _NOISE)
    return plain & (largest <= _LARGEST * sd) & (correlation < _CORRELATED)
