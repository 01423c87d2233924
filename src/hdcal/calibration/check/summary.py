"""A case that was read, as an answer."""

import numpy as np

from hdcal.calibration.check.answer import (
    CheckAnswer,
    CheckedData,
    CheckedGear,
    EffectsInReach,
    Ends,
    RowsByMovement,
    SpecimenRead,
    StatedError,
)
from hdcal.calibration.check.document import (
    DOUBTFUL,
    EACH,
    HEADLINE,
    OWN_SCATTER,
    STATED,
    check_document,
)
from hdcal.data.case import Case, Gear
from hdcal.data.certificates import ZEROS, certificate_priors, is_stated
from hdcal.data.gear_schema import certificates_in
from hdcal.data.gear_text import gear_text
from hdcal.data.loading import loading
from hdcal.physics.registry import EFFECTS
from hdcal.physics.theory import THEORIES
from hdcal.report.document import Document
from hdcal.report.units import UNITS

# Prior sds of log K within which 99.7 % of it lies.
_FAR = 3.0


def check_answer(case: Case) -> CheckAnswer:
    """Return what was understood of a case, ready for JSON."""
    gear, records = case.gear, case.records
    doubt = _doubt(case)
    lacking = {
        name: tuple(sorted(effect.needs - records.known))
        for name, effect in EFFECTS.items()
    }
    return CheckAnswer(
        status="ok",
        reasons=(),
        headline=DOUBTFUL if doubt else HEADLINE,
        next_step=EACH if "specimens" in records.known and not doubt else None,
        case=case.name,
        gear=CheckedGear(
            name=gear.name,
            material=gear.material,
            theory=gear.theory,
            deformation=gear.reading,
            reference_temperature_C=gear.reference_temperature,
            force_resolution_N=gear.force_resolution or None,
        ),
        certificates=_certificates(gear),
        data=_data(case),
        specimens=_specimens(case),
        effects=EffectsInReach(
            testable=tuple(name for name, lack in lacking.items() if not lack),
            not_testable={name: lack for name, lack in lacking.items() if lack},
        ),
        notes=(*doubt, *_scatter(case), *case.notes),
    )


def case_document(case: Case) -> Document:
    """Return the report of a check of a case that was read."""
    return check_document(check_answer(case))


def reading_columns(case: Case) -> dict[str, np.ndarray]:
    """Return what was read, under the headers of a file of hdcal's own.

    Args:
        case: whose readings; columns that it lacks are left out.
    """
    records, known = case.records, case.records.known
    columns = {
        "deformation_mm": np.asarray(records.deformation),
        "force_N": np.asarray(records.force),
    }
    others = {
        "temperature_C": records.temperature,
        "time_s": records.time,
        "angle_rad": records.angle,
        "force_sd_N": records.force_sd,
    }
    for header, values in others.items():
        if header.rpartition("_")[0] in known:
            columns[header] = np.asarray(values)
    for name, labels in (("run", case.run_labels), ("specimen", case.specimen_labels)):
        if name in known:
            columns[name] = np.array(labels)[np.asarray(getattr(records, name))]
    return columns


def gear_file(case: Case) -> str:
    """Return a gear file for readings that came without one."""
    gear = case.gear
    # Nothing said whether they are radial or diametral: that stays open.
    measured = {"reference_temperature_C": gear.reference_temperature}
    named = {"name": case.name, "theory": gear.theory}
    return gear_text(named, measured, case.columns)


def _certificates(gear: Gear) -> tuple[StatedError, ...]:
    """Say what comes of the certificates that the gear file states."""
    priors = {name: gear.priors[name] for name in ZEROS} | gear.gauge_priors
    stated = certificate_priors(certificates_in(gear.source))
    return tuple(
        StatedError(
            name,
            float(stated[name].numbers[1]) * UNITS[name][1],
            UNITS[name][0],
            stated[name].source,
            STATED[name],
        )
        for name, prior in priors.items()
        if is_stated(prior)
    )


def _scatter(case: Case) -> tuple[str, ...]:
    return (OWN_SCATTER,) if "force_sd" in case.records.known else ()


def _doubt(case: Case) -> tuple[str, ...]:
    """Say so where a straight line through the readings has no plausible K."""
    gear, records = case.gear, case.records
    prior, modulus = gear.priors["K"], gear.priors["E0"].numbers[0]
    if prior.family != "lognormal":
        return ()
    radial = np.asarray(records.deformation) / (2 if gear.reading == "diametral" else 1)
    slope = float(np.polyfit(radial, np.asarray(records.force), 1)[0])
    K = slope / float(THEORIES[gear.K_theory](gear.geometry, modulus))
    median, log_sd = prior.numbers
    low, high = (median * np.exp(side * _FAR * log_sd) for side in (-1.0, 1.0))
    if low <= K <= high:
        return ()
    return (
        f"a straight line through the readings makes K = {K:.3g}, expected {low:.3g} "
        f"to {high:.3g}: a wrong sign or unit, reading (radial or diametral) or size "
        "of the gear?",
    )


def _data(case: Case) -> CheckedData:
    records = case.records
    way = loading(np.asarray(records.deformation), np.asarray(records.direction))
    rows = [int(np.count_nonzero(way == sign)) for sign in (1, 0, -1)]
    return CheckedData(
        rows=len(records.force),
        runs=case.run_labels,
        specimens=case.specimen_labels,
        deformation_mm=_ends(records.deformation),
        force_N=_ends(records.force),
        temperature_C=_ends(records.temperature),
        temperature_measured="temperature" in records.known,
        direction=RowsByMovement(*rows),
        known=tuple(sorted(records.known)),
        sha256=case.data_sha256,
    )


def _specimens(case: Case) -> tuple[SpecimenRead, ...]:
    """Return what was read of each specimen, where there are several."""
    names, records = case.specimen_labels, case.records
    if len(names) < 2:
        return ()
    run, specimen = np.asarray(records.run), np.asarray(records.specimen)
    read = np.asarray(records.deformation)
    # Each run counts from its first reading: of none that moves nothing is left over.
    first = np.unique(run, return_index=True)[1]
    x, y = (
        values - (np.bincount(run, values) / np.bincount(run))[run]
        for values in (read - read[first][run], np.asarray(records.force))
    )
    xx, xy = (np.bincount(specimen, w) for w in (x * x, x * y))
    slopes = np.full(len(names), np.nan)
    np.divide(xy, xx, out=slopes, where=xx > 0.0)
    runs = np.bincount(specimen[first])
    columns = (names, np.bincount(specimen).tolist(), runs.tolist(), slopes.tolist())
    return tuple(SpecimenRead(*each) for each in zip(*columns, strict=True))


def _ends(values) -> Ends:
    return float(np.min(values)), float(np.max(values))
