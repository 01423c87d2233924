"""From measurements and gear to a case: screened, with motion and priors."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdcal.data.case import Case, Gear
from hdcal.data.correlation_prior import with_correlation_prior
from hdcal.data.deformation_scatter import without_scatter
from hdcal.data.full_scale import scale_of
from hdcal.data.further_labels import further_labels
from hdcal.data.gear import at_full_scale
from hdcal.data.loading import Motion, derive_motion
from hdcal.data.measurements import Measurements
from hdcal.data.reading_notes import reading_notes
from hdcal.data.records import Records
from hdcal.data.screened import asked_range, screened, screening_notes, with_zeros
from hdcal.data.theory_names import SPRING
from hdcal.data.turning_rows import sense_at_turns
from hdcal.errors import Finding, InputError
from hdcal.quantities import TORQUE

MANY = 3  # labels from which a spread between runs or specimens can be estimated


def case_of(
    measured: Measurements,
    found: Gear,
    told: Sequence[str],
    name: str,
    range: str | None = None,
    skip_bad: bool | None = None,
) -> Case:
    """Return what was measured on a gear, or several of its kind, as a case.

    Args:
        measured: in which nothing is wrong.
        found: as its file has it.
        told: notes on how that was found.
        name: of the case.
        range: working range; by default that of the gear file.
        skip_bad: as in `read_case`.

    Raises:
        InputError: as `screened`.
    """
    if measured.columns.units == TORQUE:
        _require_torsion(found, name)
    wanted = asked_range(range or found.source.get("measurement", {}).get("range"))
    measured, screening = screened(measured, wanted, skip_bad)
    motion = _motion(measured, hidden=screening.trembling)
    of_reading = [*reading_notes(measured, found, motion)]
    of_reading += screening_notes(screening, measured.columns.units)
    run = with_zeros(measured.run, screening)
    if run is not measured.run:
        measured = replace(measured, run=run)
        motion = _motion(measured, hidden=screening.trembling)
    if screening.deformation_sd > 0.0:
        measured = _without_scatter(measured)
    further, of_further = further_labels(
        measured.columns.values, measured.specimen, measured.run
    )
    values = measured.columns.values
    found = with_correlation_prior(
        found, values["deformation"], measured.run.index, values.get("time")
    )
    scale = scale_of(values["force"], values["deformation"], found.reading)
    found = at_full_scale(found, scale)
    if measured.columns.units == TORQUE:
        # The shipped prior is that of a contact, in mm.
        zero = {"deformation_offset": scale.own(found.priors["deformation_offset"])}
        found = replace(found, priors=found.priors | zero)
    return Case(
        name=name,
        gear=found,
        records=_records(measured, found, motion),
        run_labels=measured.run.names,
        specimen_labels=measured.specimen.names,
        data_sha256=measured.columns.sha256,
        notes=(
            *measured.columns.notes,
            *told,
            *of_reading,
            *of_further,
        ),
        columns=measured.columns.as_named(),
        left_out=measured.left_out,
        excluded=screening.excluded if len(measured.specimen.names) == 1 else (),
        screening=screening,
        units=measured.columns.units,
        **further,
    )


def _require_torsion(found: Gear, name: str) -> None:
    """Refuse a gear file that speaks of forces where torques were measured.

    Raises:
        InputError: it does.
    """
    if found.theory != SPRING:
        words = f"torques over angles are no readings of the theory {found.theory}"
        remedy = "Leave the gear file out, or state the theory spring in it"
        raise InputError([Finding(name, words, remedy)])
    stated = found.source.get("measurement", {})
    lengths = [key for key in stated if key.endswith(("_N", "_mm", "_calibration"))]
    wrong = [*lengths, *(key for key in ("priors", "rig") if key in found.source)]
    if wrong:
        words = f"the gear file states {', '.join(wrong)} of forces and deformations, "
        words += "and the readings are torques over angles"
        raise InputError([Finding(name, words, "Leave these entries out")])


def _without_scatter(measured: Measurements) -> Measurements:
    """Return measurements without the scatter of the displacement gauge."""
    values = measured.columns.values
    steady, force = without_scatter(
        values["deformation"], values["force"], measured.run.index
    )
    moved = values | {"deformation": steady, "force": force}
    return replace(measured, columns=replace(measured.columns, values=moved))


def _motion(measured: Measurements, *, hidden: bool) -> Motion:
    values, run = measured.columns.values, measured.run.index
    time = values.get("time")
    motion = derive_motion(values["deformation"], run, time, hidden=hidden)
    sense = sense_at_turns(motion.sense, values["deformation"], values["force"], run)
    return replace(motion, sense=sense)


def _records(measured: Measurements, gear: Gear, motion: Motion) -> Records:
    values, run = measured.columns.values, measured.run.index
    zeros = np.zeros(len(run))
    # NumPy arrays: JAX takes them when it computes, and reading starts no device
    return Records(
        deformation=values["deformation"],
        temperature=values.get("temperature", zeros + gear.reference_temperature),
        time=values.get("time", zeros),
        angle=values.get("angle", zeros),
        direction=motion.direction,
        sense=motion.sense,
        rate=motion.rate,
        run=run,
        specimen=measured.specimen.index,
        force=values["force"],
        force_sd=values.get("force_sd", zeros),
        known=motion.features | _known(measured),
    )


def _known(measured: Measurements) -> frozenset[str]:
    values = measured.columns.values
    known = {"temperature", "time", "angle", "force_sd"} & values.keys()
    if "force_sd" in known and not values["force_sd"].any():
        known.remove("force_sd")  # a column of zeros says that nothing is known
    for name, labels in (("run", measured.run), ("specimen", measured.specimen)):
        if len(labels.names) > 1:
            known.add(name)
        if len(labels.names) >= MANY:
            known.add(name + "s")
    return frozenset(known)
