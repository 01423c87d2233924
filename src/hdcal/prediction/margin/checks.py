"""What is wrong with the questions that are asked of a margin."""

from collections.abc import Sequence

import numpy as np

from hdcal.data.plausible import implausible
from hdcal.data.priors import rig_priors
from hdcal.data.records import lies_far
from hdcal.errors import Finding, InputError
from hdcal.inference.posterior import Posterior
from hdcal.prediction.engine.causes import Cause, likeliest
from hdcal.prediction.engine.conditions import (
    DIRECTIONS,
    SENSE,
    excluded_findings,
    level_findings,
    slip_findings,
    temperature_findings,
)
from hdcal.prediction.engine.forces import QUANTITIES
from hdcal.prediction.engine.loading_sense import LoadingSense, capacity_findings
from hdcal.prediction.engine.population import check_population
from hdcal.prediction.engine.population_force import MOST_DRAWS
from hdcal.prediction.engine.sizes import check_tolerances
from hdcal.prediction.margin.request import Criteria, MarginRequest
from hdcal.prediction.margin.result import Level
from hdcal.prediction.margin.stated import RULES
from hdcal.prediction.margin.temperatures import MOST_TEMPERATURES
from hdcal.prediction.shares import check_rarity, check_shares
from hdcal.quantities import Quantities


def check_margin(
    causes: Sequence[Cause],
    request: MarginRequest,
    temperature: np.ndarray,
    criteria: Criteria,
    sense: LoadingSense,
) -> None:
    """Refuse what cannot be asked, all of it at once.

    Args:
        causes: of all models.
        request: whose force, and where.
        temperature: all that are asked for [°C].
        criteria: what is to be kept.
        sense: of loading.

    Raises:
        InputError: holds every finding.
    """
    cause, at = likeliest(causes), request.deformation
    gear, theory = cause.posterior.case.gear, cause.posterior.theory
    names = "content", "confidence", "required_probability"
    shares = {n: v for n in names if (v := getattr(criteria, n)) is not None}
    units = cause.posterior.case.units
    limit, place = criteria.limit_force, f"{at:g} {units.displacement_unit}"
    forces = {"limit_force": limit, "given_force": request.given_force}
    draws = sum(min(c.size, MOST_DRAWS) for c in causes)
    more = ", or calibrate with more draws" if draws < MOST_DRAWS else ""
    movement = sense * SENSE.get(request.direction, 0.0)
    wrong = _check_deformation(cause, at, movement)
    findings = [
        *wrong,
        *_check_temperature(cause, temperature),
        *check_shares(**shares),
        *check_rarity(shares, draws, more),
        *implausible("seed", request.seed),
        *check_population(request.population, cause.problem),
        *check_tolerances(request.tolerances, gear.geometry, theory),
        # Beside a deformation that is refused no force looks right.
        *([] if wrong else _check_forces(cause, at, forces)),
    ]
    if limit is not None and not wrong:
        findings += capacity_findings("limit_force", limit, sense, place, units)
    findings += _check_choices(request, criteria)
    if request.quantity == "load" and not _knows_contact(cause.posterior):
        words = "needs the place of first contact, and the readings are far from 0"
        remedy = "State deformation_offset in [priors], or count from there"
        findings.append(Finding("quantity", words, remedy))
    if findings:
        raise InputError(findings)


def _knows_contact(posterior: Posterior) -> bool:
    """Return whether the origin may be first contact, or the gear file states that."""
    name = "deformation_offset"
    stated = posterior.priors[name].source != rig_priors()[name].source
    return stated or not lies_far(posterior.case.records)


def check_sign(
    levels: Sequence[Level],
    request: MarginRequest,
    criteria: Criteria,
    sense: LoadingSense,
    units: Quantities,
) -> None:
    """Refuse a capacity where the force has the sign against the sense of loading.

    Args:
        levels: the force at each temperature.
        request: whose force, and where.
        criteria: with the capacity, if there is one.
        sense: of loading.
        units: of what was measured.

    Raises:
        InputError: the gauge's zero is larger than the load.
    """
    members = [level.member_N for level in levels]
    against = [one for one in members if max(sense * one.lo, sense * one.hi) < 0.0]
    if criteria.limit_force is None or not against:
        return
    unit = units.load_unit
    place = f"{request.deformation:g} {units.displacement_unit}"
    done, sign = ("pressed", "negative") if sense > 0 else ("pulled", "positive")
    words = (
        f"nothing can be said of {criteria.limit_force:g} {unit} at {place}: the gear "
        f"is {done} there, and its {request.quantity} is {sign}, "
        f"{against[0].lo:.3g} … {against[0].hi:.3g} {unit}"
    )
    remedy = f"Ask for the quantity load, or at a larger {units.displacement}"
    raise InputError([Finding("limit_force", words, remedy)])


def _check_deformation(
    cause: Cause, deformation: float, movement: float
) -> list[Finding]:
    gear, units = cause.posterior.case.gear, cause.posterior.case.units
    if wrong := implausible("deformation", deformation, units.displacement):
        return wrong
    if deformation == 0.0:
        unit = units.displacement_unit
        words = f"{deformation:g} {unit} is no {units.displacement}"
        return [Finding("deformation", words, f"Give a number of {unit}")]
    if abs(deformation) >= gear.reach:
        words = f"{deformation:g} mm on a radius of {gear.geometry.radius:g} mm"
        return [Finding("deformation", words, "Give it in mm")]
    return excluded_findings(cause.posterior.case, deformation, movement)


def _check_choices(request: MarginRequest, criteria: Criteria) -> list[Finding]:
    rule, findings = criteria.rule, []
    for name, value, known in (
        ("quantity", request.quantity, QUANTITIES),
        ("direction", request.direction, DIRECTIONS),
        ("rule", "guarded" if rule is None else rule, RULES),
    ):
        if value not in known:
            remedy = f"Use {' or '.join(known)}"
            findings.append(Finding(name, f"'{value}' is unknown", remedy))
    if rule is not None and criteria.limit_force is None:
        words, remedy = "decides nothing without a limit", "Give `limit_force` too"
        findings.append(Finding("rule", words, remedy))
    return findings


def _check_temperature(cause: Cause, temperature) -> list[Finding]:
    name = "temperature"
    many = level_findings(temperature, name, MOST_TEMPERATURES)
    return many or temperature_findings(
        cause.posterior.case.gear, cause.values, temperature
    )


def _check_forces(cause: Cause, deformation, forces) -> list[Finding]:
    usual = abs(float(np.median(cause.values["stiffness"])) * deformation)
    findings, units = [], cause.posterior.case.units
    for name, force in forces.items():
        if force is None:
            continue
        if wrong := implausible(name, force):
            findings += wrong
        elif force == 0.0:
            words = f"{force:g} {units.load_unit} is no {units.load}"
            remedy = f"Give a number of {units.load_unit}"
            findings.append(Finding(name, words, remedy))
        else:
            findings += slip_findings(name, force, usual, deformation, units)
    return findings
