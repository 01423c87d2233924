"""Screening of a record, run by run, before any model is fitted."""

import numpy as np

from hdcal.screening.branches import name_segments, straight_part
from hdcal.screening.channels import HIDDEN
from hdcal.screening.ends import rows_after_drop
from hdcal.screening.faults import look_at
from hdcal.screening.result import DROPPED, Screening
from hdcal.screening.run import Run
from hdcal.screening.sign import Sign, plain_runs, sign_of_slope
from hdcal.screening.wild import FEWEST
from hdcal.screening.working_range import WorkingRange

# Rows from which the sign of a slope can be told.
_FEWEST_FOR_SIGN = 5


def screen(
    deformation: np.ndarray,
    force: np.ndarray,
    run: np.ndarray | None = None,
    *,
    whole: bool = True,
    wanted: WorkingRange | None = None,
) -> Screening:
    """Look at a record: what of it is no curve of a part, and what was done about it.

    Args:
        deformation: as read [mm], in the order it was taken, shape (n,).
        force: as read [N], shape (n,).
        run: index of the mounting, shape (n,); by default one.
        whole: whether these are all runs. Of some of them nobody knows whether the sign
            is opposite in every run, so that it is asked about and not turned.
        wanted: working range. Where force and deformation grow together in it, the sign
            is the usual one.
    """
    x, y = np.array(deformation, float), np.array(force, float)
    n = x.size
    index = np.zeros(n, int) if run is None else np.asarray(run)
    order = np.argsort(index, kind="stable")
    cuts = np.flatnonzero(np.diff(index[order])) + 1
    runs = []
    plain = plain_runs(x, y, index)
    for rows in np.split(order, cuts) if n else []:
        one = Run.of(rows, x, y, int(index[rows[0]]))
        one.plain = bool(plain[one.index])
        look_at(one)
        runs.append(one)
    _signs(runs, wanted, whole=whole)
    for one in runs:
        name_segments(one)
    return _gathered(runs, n)


def _gathered(runs: list[Run], n: int) -> Screening:
    """Return the screened runs as one record."""
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
        slope = _rough_slope(one.x[rows], one.y[rows])
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


def _rough_slope(x: np.ndarray, y: np.ndarray) -> float:
    return float(np.polyfit(x - x.mean(), y - y.mean(), 1)[0])
