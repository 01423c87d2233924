"""Measurements after their screening: rows cut, zeros moved back."""

from dataclasses import replace

import numpy as np

from hdcal.data.measurements.bad_gears import among, offer
from hdcal.data.measurements.deformation_scatter import without_scatter
from hdcal.data.measurements.measurements import FEWEST_ROWS, Measurements
from hdcal.errors import Finding, InputError
from hdcal.quantities import Quantities
from hdcal.screening.result import Screening
from hdcal.screening.screen import screen
from hdcal.screening.words import hidden_direction, in_words, question
from hdcal.screening.working_range import (
    FORM,
    STRAIGHT,
    WorkingRange,
    in_range,
    read_range,
)

# Findings that are spelled out.
_LISTED = 50


def asked_range(wanted: str | None) -> WorkingRange | None:
    """Read a working range.

    Raises:
        InputError: it is none.
    """
    if wanted is None:
        return None
    try:
        return read_range(str(wanted))
    except ValueError as error:
        raise InputError([Finding("range", str(error), FORM)]) from None


def screened(
    measured: Measurements,
    wanted: WorkingRange | None = None,
    skip_bad: bool | None = None,
    *,
    whole: bool = True,
) -> tuple[Measurements, Screening]:
    """Look at a record, and return what of it is a curve of the part.

    Args:
        measured: as read.
        wanted: working range; by default all of it.
        skip_bad: as in `read_case`.
        whole: whether these are all rows of the source.

    Raises:
        InputError: holds what only the user can decide about; or hardly a row is left.
    """
    x, (run, _), rows = measured["deformation"], measured.runs, measured.rows
    units = measured.units
    found = screen(x, measured["force"], measured.get("time"), run, whole=whole)
    if found.asked:
        gears = measured["specimen"]
        questions = [
            Finding(measured.file, *question(one, rows, units)) for one in found.asked
        ]
        bad: dict[str, Finding] = {}
        for one, finding in zip(found.asked, questions, strict=True):
            bad.setdefault(str(gears[one.rows[0][0]]), finding)
        many = len({*gears})
        if skip_bad and (len(bad) < many or not whole):
            left = measured.where(~among(gears, bad))
            left = replace(left, left_out={**measured.left_out, **bad})
            return screened(left, wanted, whole=whole)
        offered = skip_bad is False and (len(bad) < many or not whole)
        offers = [offer(bad, many if whole else None)] if offered else []
        raise InputError([*questions, *offers])
    if wanted is not None:
        if wanted.unit == STRAIGHT and found.straight is None:
            words = "is straight, and the data are of several runs, or of cycles whose "
            words += "movements are no straight lines"
            raise InputError([Finding("range", words, FORM)])
        found = in_range(found, wanted, run, units)
    observations = tuple(
        in_words(one, rows, found.working_range, units) for one in found.observations
    )
    found = replace(found, observations=observations)
    kept = int(found.kept.sum())
    if whole and kept < min(FEWEST_ROWS, run.size):
        problem = f"{kept} of {run.size} rows are left"
        problem += f" between {wanted.words(units)}" if wanted is not None else ""
        remedy = f"At least {FEWEST_ROWS} are needed. The {units.displacement} was "
        ends = f"{x.min():.4g} to {x.max():.4g} {units.displacement_unit}"
        remedy += f"read from {ends}"
        raise InputError([Finding(measured.file, problem, remedy)])
    moved = {"deformation": found.deformation, "force": found.force, "zero": found.zero}
    if found.time is not None:
        moved["time"] = found.time
    kept_rows = measured.assign(**moved).where(found.kept)
    return _without_scatter(kept_rows, run[found.kept], found), found


def _without_scatter(
    measured: Measurements, run: np.ndarray, found: Screening
) -> Measurements:
    """Return rows without the scatter of the deformation, of runs that show it."""
    x, force = measured["deformation"].copy(), measured["force"].copy()
    shaken = {o.run for o in found.observations if o.action == "smoothed"}
    for index in shaken:
        rows = np.flatnonzero(run == index)
        zero = measured["zero"][rows]
        x[rows], force[rows] = without_scatter(x[rows], force[rows], zero)
    return measured.assign(deformation=x, force=force) if shaken else measured


def screening_notes(found: Screening, units: Quantities) -> list[str]:
    """Return what was found in a record, each finding in one sentence.

    Args:
        found: its screening.
        units: of what was measured.
    """
    notes = [one.words for one in found.observations]
    more = [f"and {len(notes) - _LISTED} more findings"] if notes[_LISTED:] else []
    hidden = [hidden_direction(units)] if found.trembling else []
    return [*notes[:_LISTED], *more, *hidden]
