"""Measurements after their screening: rows cut, zeros moved back, scatter removed."""

import math
from dataclasses import replace

import numpy as np
from scipy.interpolate import make_smoothing_spline

from hdcal.data.measurements.bad_gears import among, offer
from hdcal.data.measurements.checks import FEWEST_ROWS
from hdcal.data.measurements.measurements import Measurements
from hdcal.data.records import less_run_means
from hdcal.errors import Finding, InputError
from hdcal.quantities import Quantities
from hdcal.screening.result import Screening
from hdcal.screening.screen import screen
from hdcal.screening.words import HIDDEN, in_words, question
from hdcal.screening.working_range import (
    FORM,
    STRAIGHT,
    WorkingRange,
    in_range,
    read_range,
)

_LISTED = 50  # findings of a record that are listed


def asked_range(wanted: str | None) -> WorkingRange | None:
    """Read a working range, or raise InputError."""
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
    """Return the rows of a record that are a curve of the part, and its screening.

    `whole`: these are all rows of the source.

    Raises:
        InputError: holds what only the user can decide about; or hardly a row is left.
    """
    x, (run, _), rows = measured["deformation"], measured.runs, measured.rows
    units = measured.units
    result = screen(x, measured["force"], run, whole=whole, wanted=wanted)
    if result.asked:
        left = _without_asked(measured, result, skip_bad, whole=whole)
        return screened(left, wanted, whole=whole)
    if wanted is not None:
        if wanted.unit == STRAIGHT and result.straight is None:
            words = "is straight, but the data contain several runs, or cycles without "
            words += "straight movements"
            remedy = "Give its ends, as 0.1:0.6 in mm or 10%:40% of the largest force"
            raise InputError([Finding("range", words, remedy)])
        result = in_range(result, wanted, run, units)
    reach, gears = result.working_range, measured["specimen"]
    found = tuple(
        replace(in_words(o, rows, reach, units), gear=str(gears[o.rows[0][0]]))
        for o in result.observations
    )
    result = replace(result, observations=found)
    kept = int(result.kept.sum())
    if whole and kept < min(FEWEST_ROWS, run.size):
        problem = f"{kept} of {run.size} rows are left"
        if wanted is not None and math.isfinite(wanted.high):
            problem += f" within {wanted.words(units)}"
        remedy = f"At least {FEWEST_ROWS} are needed. The {units.displacement} ranges "
        ends = f"{x.min():.4g} to {x.max():.4g} {units.displacement_unit}"
        raise InputError([Finding(measured.file, problem, f"{remedy}from {ends}")])
    moved = {name: getattr(result, name) for name in ("deformation", "force", "zero")}
    left = measured.assign(**moved).where(result.kept)
    return _without_scatter(left, run[result.kept], result), result


def _without_asked(
    measured: Measurements, result: Screening, skip_bad: bool | None, *, whole: bool
) -> Measurements:
    """Return measurements without gears about which only the user can decide."""
    gears = measured["specimen"]
    questions, bad = [], {}
    for observation in result.asked:
        words = question(observation, measured.rows, measured.units)
        questions.append(Finding(measured.file, *words))
        bad.setdefault(str(gears[observation.rows[0][0]]), questions[-1])
    many = len({*gears})
    some = len(bad) < many or not whole
    if skip_bad and some:
        left = measured.where(~among(gears, bad))
        return replace(left, left_out={**measured.left_out, **bad})
    if skip_bad is False and some:
        questions.append(offer(bad, many if whole else None))
    raise InputError(questions)


def _without_scatter(
    measured: Measurements, run: np.ndarray, result: Screening
) -> Measurements:
    """Return the kept rows without the scatter of the deformation, where it shows.

    Scatter in the deformation makes a fitted slope too small by the share that it has
    in the variance of the deformation (regression dilution). The deformation smoothed
    over the rows is an instrument (two-stage least squares): each reading moves
    parallel to the line to its smoothed deformation. Its distance from the line stays,
    so that the interval of the slope counts the scatter.
    """
    x, force = measured["deformation"].copy(), measured["force"].copy()
    shaken = {o.run for o in result.observations if o.action == "smoothed"}
    for index in shaken:
        rows = np.flatnonzero(run == index)
        zero = measured["zero"][rows]
        smooth = x[rows].copy()
        for label in np.unique(zero):
            part = zero == label
            # SciPy makes no spline of fewer rows.
            if part.sum() >= FEWEST_ROWS:
                order = np.arange(part.sum(), dtype=float)
                smooth[part] = make_smoothing_spline(order, x[rows][part])(order)
        place, height = (less_run_means(each, zero) for each in (smooth, force[rows]))
        slope = float(place @ height) / float(place @ place)
        force[rows] += slope * (smooth - x[rows])
        x[rows] = smooth
    return measured.assign(deformation=x, force=force) if shaken else measured


def screening_notes(result: Screening, units: Quantities) -> list[str]:
    """Return the findings of a screening, each in one sentence."""
    notes = [one.words for one in result.observations]
    more = [f"and {len(notes) - _LISTED} more findings"] if notes[_LISTED:] else []
    hidden = [units.say(HIDDEN)] if result.trembling else []
    return [*notes[:_LISTED], *more, *hidden]
