"""From measurements and gear to a case: screened, with motion and priors."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdcal.data.case import Case, Gear
from hdcal.data.gear import at_full_scale
from hdcal.data.gear_file.rig_facts import correlation_prior
from hdcal.data.loading import Motion, derive_motion, sense_at_turns
from hdcal.data.measurements.labels import further_labels
from hdcal.data.measurements.measurements import Measurements
from hdcal.data.measurements.notes import (
    ASSUMED,
    gear_notes,
    mountings_note,
    positions_note,
    resets_note,
    rigs_note,
)
from hdcal.data.measurements.screened import asked_range, screened, screening_notes
from hdcal.data.prior import Prior, scale_of
from hdcal.data.priors import rig_priors
from hdcal.data.records import OF_POSITIONS, Records, lies_far
from hdcal.data.theory_names import SPRING
from hdcal.errors import Finding, InputError
from hdcal.quantities import TORQUE
from hdcal.screening.result import Screening

MANY = 3  # labels from which a spread between runs or specimens can be estimated
_CORRELATION = "noise_correlation"
# Facts of a rig that presses, and not of one that twists.
_OF_FORCE = ("deformation", "force_calibration", "deformation_calibration")


def case_of(
    measured: Measurements,
    gear: Gear,
    notes: Sequence[str],
    name: str,
    range: str | None = None,
    skip_bad: bool | None = None,
) -> Case:
    """Return what was measured on a gear, or several of its kind, as a case."""
    wanted = asked_range(range or gear.source.get("measurement", {}).get("range"))
    before = gear_notes(gear, measured["force"], measured.get("temperature"))
    notes = [*notes, *before]
    measured, screening = screened(measured, wanted, skip_bad)
    return screened_case(measured, screening, gear, notes, name)


def screened_case(
    measured: Measurements,
    screening: Screening | None,
    gear: Gear,
    notes: Sequence[str],
    name: str,
) -> Case:
    """Return measurements that were screened as a case."""
    if measured.units == TORQUE:
        _require_torsion(gear, name)
    (specimen, gears), (run, runs) = measured.gears, measured.runs
    hidden, x = screening is not None and screening.trembling, measured["deformation"]
    motion = derive_motion(x, run, measured.get("time"), hidden=hidden)
    sense = sense_at_turns(motion.sense, x, measured["force"], run)
    motion = replace(motion, sense=sense)
    gear = _at_own_scale(gear, measured, run)
    further, of_labels = further_labels(measured.frame, specimen, gears, run, runs)
    mounted = len(measured.assign(zero=np.zeros(len(run), int)).runs[1])
    every = [
        *measured.notes,
        *notes,
        *resets_note(motion, measured.rows, measured.units),
        *mountings_note(measured.stated, mounted, len(gears)),
        *rigs_note(measured.get("rig", ()), len(gears)),
        *positions_note(gear, x, measured.units),
        *([] if screening is None else screening_notes(screening, measured.units)),
        *of_labels,
    ]
    cut = screening if len(gears) == 1 else None
    return Case(
        name=name,
        gear=gear,
        records=_records(measured, gear, motion, run, specimen),
        run_labels=runs,
        specimen_labels=gears,
        data_sha256=measured.sha256,
        notes=tuple(sorted(every, key=lambda note: not note.startswith(ASSUMED))),
        columns=measured.named,
        left_out=measured.left_out,
        excluded=() if cut is None else cut.excluded,
        excluded_sense=0 if cut is None else cut.excluded_sense,
        screening=screening,
        units=measured.units,
        **further,
    )


def _at_own_scale(gear: Gear, measured: Measurements, run: np.ndarray) -> Gear:
    """Return a gear whose shipped priors are those of its rig and its readings."""
    x, priors, scales = measured["deformation"], gear.priors, gear.scale_priors
    if scales[_CORRELATION].source == rig_priors()[_CORRELATION].source:
        cutoff = gear.source.get("rig", {}).get("filter_Hz")
        prior = correlation_prior(cutoff, x, run, measured.get("time"))
        scales = scales | {_CORRELATION: prior}
    scale = scale_of(measured["force"], x, gear.reading)
    zero = priors["deformation_offset"]
    if measured.units == TORQUE:
        # The shipped prior is that of a contact, in mm.
        priors = priors | {"deformation_offset": scale.own(zero)}
    if zero.source == rig_priors()["deformation_offset"].source:
        unloaded = _position_without_load(x, measured["force"])
        if unloaded is not None:
            numbers = (unloaded, scale.own(zero).numbers[1])
            of_positions = Prior("normal", numbers, zero.unit, OF_POSITIONS)
            priors = priors | {"deformation_offset": of_positions}
    return at_full_scale(replace(gear, priors=priors, scale_priors=scales), scale)


def _position_without_load(deformation: np.ndarray, force: np.ndarray) -> float | None:
    """Return where a straight line through readings of a position has no force.

    None where they are deformations: they, or that place, are near the origin.
    """
    if not deformation.size or not lies_far(deformation):
        return None
    x, y = (values - np.mean(values) for values in (deformation, force))
    width, pull = float(np.ptp(deformation)), float(x @ y)
    if pull <= 0.0:
        return None
    place = float(np.mean(deformation) - np.mean(force) * float(x @ x) / pull)
    digit = 10.0 ** np.floor(np.log10(width) - 3)
    return float(np.round(place / digit) * digit) if abs(place) > width else None


def _require_torsion(gear: Gear, name: str) -> None:
    """Refuse a gear file on forces where torques were measured."""
    if gear.theory != SPRING:
        words = f"the theory {gear.theory} does not apply to torques over angles"
        remedy = "Leave the gear file out, or state theory = 'spring' in it"
        raise InputError([Finding(name, words, remedy)])
    stated = [*gear.source.get("gear", {}), *gear.source.get("measurement", {})]
    wrong = [key for key in stated if key.endswith(("_N", "_mm")) or key in _OF_FORCE]
    if wrong := [*wrong, *({"priors", "rig"} & gear.source.keys())]:
        words = f"the gear file states {', '.join(wrong)} for forces and deformations, "
        words += "but the readings are torques over angles"
        raise InputError([Finding(name, words, "Leave these entries out")])


def _records(
    measured: Measurements,
    gear: Gear,
    motion: Motion,
    run: np.ndarray,
    specimen: np.ndarray,
) -> Records:
    known = {"temperature", "time", "angle", "force_sd"} & {*measured.frame}
    if "force_sd" in known and not measured["force_sd"].any():
        known.remove("force_sd")  # a column of zeros says that nothing is known
    for name, index in (("run", run), ("specimen", specimen)):
        many = int(index.max(initial=0)) + 1
        known |= {name} if many > 1 else set()
        known |= {f"{name}s"} if many >= MANY else set()
    zeros = np.zeros(len(run))
    # NumPy arrays: JAX takes them when it computes, and reading starts no device
    return Records(
        deformation=measured["deformation"],
        temperature=measured.get("temperature", zeros + gear.reference_temperature),
        time=measured.get("time", zeros),
        angle=measured.get("angle", zeros),
        direction=motion.direction,
        sense=motion.sense,
        rate=motion.rate,
        run=run,
        specimen=specimen,
        force=measured["force"],
        force_sd=measured.get("force_sd", zeros),
        known=motion.features | known,
    )
