"""Measurements after their screening: rows cut, zeros counted anew."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from hdcal.data.bad_gears import among, offer
from hdcal.data.measurements import Labels, Measurements
from hdcal.data.value_checks import FEWEST_ROWS
from hdcal.errors import Finding, InputError
from hdcal.quantities import Quantities
from hdcal.screening.result import Screening
from hdcal.screening.screen import screen
from hdcal.screening.words import hidden_direction, in_words, question
from hdcal.screening.working_range import FORM, WorkingRange, in_range, read_range


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
) -> tuple[Measurements, Screening]:
    """Look at a record, and return what of it is a curve of the part.

    Args:
        measured: as read.
        wanted: working range; by default all of it.
        skip_bad: as in `read_case`.

    Raises:
        InputError: holds what only the user can decide about; or hardly a row is left.
    """
    values, run = measured.columns.values, measured.run.index
    units = measured.columns.units
    found = screen(values["deformation"], values["force"], values.get("time"), run)
    labels, file = measured.columns.table.rows, measured.columns.findings.file
    if found.asked:
        bad = {
            measured.specimen.names[measured.specimen.index[one.rows[0][0]]]: Finding(
                file, *question(one, labels, units)
            )
            for one in found.asked
        }
        many = len(measured.specimen.names)
        if skip_bad and len(bad) < many:
            return screened(_without(measured, bad), wanted)
        offered = skip_bad is False and len(bad) < many
        raise InputError([*bad.values(), *([offer(bad, many)] if offered else [])])
    if wanted is not None:
        found = in_range(found, wanted, run, units)
    observations = tuple(
        in_words(one, labels, found.working_range, units) for one in found.observations
    )
    found = replace(found, observations=observations)
    rows = int(found.kept.sum())
    if rows < min(FEWEST_ROWS, run.size):
        words = f"{rows} of {run.size} rows are left"
        words += f" between {wanted.words(units)}" if wanted is not None else ""
        x = values["deformation"]
        remedy = f"At least {FEWEST_ROWS} are needed. The {units.displacement} was "
        ends = f"{x.min():.4g} to {x.max():.4g} {units.displacement_unit}"
        remedy += f"read from {ends}"
        raise InputError([Finding(file, words, remedy)])
    return _kept(measured, found), found


def screening_notes(found: Screening, units: Quantities) -> tuple[str, ...]:
    """Return what was found in a record, each finding in one sentence.

    Args:
        found: its screening.
        units: of what was measured.
    """
    hidden = [hidden_direction(units)] if found.trembling else []
    return (*(one.words for one in found.observations), *hidden)


def with_zeros(run: Labels, found: Screening) -> Labels:
    """Return runs of which the rows after each jump of a zero are one of their own.

    Args:
        run: of the rows that are kept.
        found: the screening.
    """
    zero = found.zero[found.kept]
    if not zero.any():
        return run
    index, pairs = pd.factorize(run.index * (int(zero.max()) + 1) + zero)
    names = []
    for pair in pairs:
        place, jumps = divmod(int(pair), int(zero.max()) + 1)
        name = run.names[place]
        names.append(f"{name} (zero {jumps + 1})" if jumps else name)
    return Labels(index, tuple(names))


def _kept(measured: Measurements, found: Screening) -> Measurements:
    """Return the rows that are kept, their zeros moved back."""
    columns = measured.columns
    values = {**columns.values, "deformation": found.deformation, "force": found.force}
    if found.time is not None:
        values["time"] = found.time
    if found.kept.all():
        return replace(measured, columns=replace(columns, values=values))
    return _of_rows(measured, values, found.kept)


def _without(measured: Measurements, bad: Mapping[str, Finding]) -> Measurements:
    """Return measurements without the gears that only the user can decide about."""
    kept = ~among(measured.specimen.names, bad)[measured.specimen.index]
    left = _of_rows(measured, measured.columns.values, kept)
    return replace(left, left_out={**measured.left_out, **bad})


def _of_rows(
    measured: Measurements, values: Mapping[str, np.ndarray], kept: np.ndarray
) -> Measurements:
    columns = measured.columns
    table = columns.table.take(kept)
    values = {name: column[kept] for name, column in values.items()}
    return Measurements(
        replace(columns, values=values, table=table),
        _of(measured.run, kept),
        _of(measured.specimen, kept),
        measured.left_out,
    )


def _of(labels: Labels, kept: np.ndarray) -> Labels:
    index, left = pd.factorize(labels.index[kept])
    return Labels(index, tuple(labels.names[one] for one in left))
