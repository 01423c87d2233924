"""Request of a margin, and what is wrong with one."""

from collections.abc import Iterator
from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import Field

from hdcal.data.plausible import implausible
from hdcal.data.priors import rig_priors
from hdcal.data.records import OF_POSITIONS, lies_far
from hdcal.errors import Finding, Findings
from hdcal.inference.posterior import Posterior
from hdcal.prediction.conditions import (
    DIRECTIONS,
    OFF,
    SENSE,
    Direction,
    Population,
    direction_of_loading,
    excluded_findings,
    far_findings,
    population_findings,
    share_findings,
    temperature_findings,
    usual_temperature,
    widest,
)
from hdcal.prediction.forces import QUANTITIES, Quantity
from hdcal.prediction.joint import JointModel
from hdcal.prediction.sizes import check_tolerances
from hdcal.report.item import Count, Draws, Item
from hdcal.report.item import quantity as labelled
from hdcal.report.words import digits

Rule = Literal["guarded", "simple"]
Share = Annotated[float, Field(gt=0.0, lt=1.0)]
_SHARES = ("content", "confidence")
_CHOICES: dict[str, tuple[str, ...]] = {
    "quantity": QUANTITIES,
    "direction": DIRECTIONS,
    "rule": get_args(Rule),
}
# Temperatures of one answer, at each of which every draw has a force.
_MOST_TEMPERATURES = 1_000


class MarginRequest(Item):
    """Request of a margin; see `margin`.

    The loading is +1 in compression, -1 in tension: capacities and what exceeds them
    are sizes along it, forces and bounds have their sign.
    """

    deformation_mm: float = labelled("deformation", "mm")
    direction: Direction
    loading_sense: Literal[1, -1]
    quantity: Quantity
    population: Population
    content: Share
    confidence: Share
    limit_force_N: float | None = labelled("limit", "N")
    tolerances_mm: dict[str, float]
    seed: Count
    given_force_N: float | None = Field(exclude=True)
    temperatures_C: Draws
    rule: Rule = Field(exclude=True)


def checked_request(model: JointModel, **asked: Any) -> MarginRequest:
    """Return the request that the arguments of `margin` make.

    Raises:
        InputError: holds everything that is wrong with them.
    """
    posterior, case = model.posterior, model.posterior.case
    sizes = dict(asked.pop("tolerances") or {})
    asked["rule"], rule = asked["rule"] or "guarded", asked["rule"]
    if (warm := asked.pop("temperature")) is None:
        warm = usual_temperature(case)
    with Findings() as wrong:
        for name in ("deformation", "limit_force", "given_force", *_SHARES):
            if asked[name] is not None and _axes(asked[name]) != 0:
                words, remedy = "is not a single number", "Give one number"
                wrong.append(Finding(name, words, remedy))
        if _axes(warm) not in (0, 1):
            wrong.append(
                Finding("temperature", "is not a list of numbers", "Give numbers in °C")
            )
    deformation, levels = (
        asked.pop("deformation"),
        np.atleast_1d(np.asarray(warm, float)),
    )
    loading = direction_of_loading(model, deformation)
    movement = loading * SENSE.get(asked["direction"], 0.0)
    asked["population"] = asked["population"] or widest(model.problem)
    limit, force = asked.pop("limit_force"), asked.pop("given_force")
    with Findings() as wrong:
        impossible = [*_deformation(posterior, deformation, movement)]
        wrong += impossible
        wrong += _temperatures(model, levels)
        shares, more = {n: asked[n] for n in _SHARES}, ", or calibrate with more draws"
        wrong += share_findings(shares, model.size, more)
        wrong += implausible("seed", asked["seed"])
        wrong += population_findings(asked["population"], model.problem)
        wrong += check_tolerances(sizes, case.gear.geometry, posterior.theory)
        # Beside a deformation that is refused no force looks right.
        if not impossible:
            wrong += _force(model, "limit_force", limit, deformation, loading)
            wrong += _force(model, "given_force", force, deformation, loading)
        for name, known in _CHOICES.items():
            if asked[name] not in known:
                words, remedy = (
                    f"'{asked[name]}' is not possible",
                    f"Use {' or '.join(known)}",
                )
                wrong.append(Finding(name, words, remedy))
        if rule is not None and limit is None:
            words, remedy = "needs a limit", "Give `limit_force` too"
            wrong.append(Finding("rule", words, remedy))
        if asked["quantity"] == "load" and not _knows_contact(posterior):
            words = (
                "needs the position of first contact, but the readings are far from 0"
            )
            remedy = "State deformation_offset in [priors], or measure from contact"
            wrong.append(Finding("quantity", words, remedy))
    return MarginRequest(
        **asked,
        deformation_mm=float(deformation),
        loading_sense=loading,
        limit_force_N=None if limit is None else abs(limit),
        tolerances_mm=sizes,
        given_force_N=force,
        temperatures_C=levels,
    )


def _axes(given: object) -> int | None:
    """Return the number of axes of numbers; None where it holds no numbers."""
    try:
        return None if isinstance(given, str) else np.asarray(given, float).ndim
    except (TypeError, ValueError):
        return None


def _deformation(
    posterior: Posterior, deformation: float, movement: float
) -> Iterator[Finding]:
    gear, units = posterior.case.gear, posterior.case.units
    tested = float(np.max(np.abs(posterior.case.from_unloaded)))
    name, unit = "deformation", units.displacement_unit
    if wrong := implausible(name, deformation, units.displacement):
        yield from wrong
    elif deformation == 0.0:
        words = f"the {units.displacement} is 0"
        yield Finding(name, words, f"Give a {units.displacement} in {unit}, not 0")
    elif wrong := far_findings(gear, units, deformation, tested, gear.contact):
        yield from wrong
    else:
        yield from excluded_findings(posterior.case, deformation, movement)


def _temperatures(model: JointModel, temperature: np.ndarray) -> list[Finding]:
    name = "temperature"
    if temperature.size == 0:
        return [Finding(name, "is empty", "Write it like -20:80, in °C")]
    if temperature.size > _MOST_TEMPERATURES:
        words = f"{temperature.size} temperatures are too many"
        return [Finding(name, words, f"Give at most {_MOST_TEMPERATURES}")]
    return temperature_findings(model.posterior.case.gear, model.draws, temperature)


def _force(
    model: JointModel, name: str, force: float | None, at: float, loading: int
) -> Iterator[Finding]:
    units = model.posterior.case.units
    unit, place = units.load_unit, f"{at:g} {units.displacement_unit}"
    path = at - np.median(model.draws["deformation_offset"])
    usual = abs(float(np.median(model.draws["stiffness"]) * path))
    if force is None:
        return
    if wrong := implausible(name, force):
        yield from wrong
    elif force == 0.0:
        words = f"the {units.load} is 0"
        yield Finding(name, words, f"Give a {units.load} in {unit}, not 0")
    elif usual > 0.0 and not usual / OFF < abs(force) < usual * OFF:
        words = f"{force:g} {unit} is not plausible: {place} needs about "
        words += f"{digits(usual, 3)} {unit}"
        yield Finding(name, words, f"Give the {units.load} in {unit}")
    elif name == "limit_force" and force < 0.0 < loading:
        words = (
            f"{force:g} {unit} is negative, but the {units.load} at {place} is positive"
        )
        remedy = f"Give {-force:g} {unit}, or a negative {units.displacement}"
        yield Finding(name, words, remedy)


def _knows_contact(posterior: Posterior) -> bool:
    """Return whether the origin may be first contact, or the gear file states that."""
    prior = posterior.priors["deformation_offset"]
    stated = is_stated(posterior, "deformation_offset") and prior.source != OF_POSITIONS
    return stated or not lies_far(posterior.case.records.deformation)


def is_stated(posterior: Posterior, zero: str) -> bool:
    """Return whether the prior of a zero is another than the shipped one."""
    return posterior.priors[zero].source != rig_priors()[zero].source
