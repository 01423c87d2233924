"""Request of a margin, and what is wrong with one."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import Field

from hdcal.data.plausible import implausible
from hdcal.data.priors import rig_priors
from hdcal.data.records import lies_far
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
    temperature_findings,
    usual_temperature,
    widest,
)
from hdcal.prediction.forces import QUANTITIES, Quantity
from hdcal.prediction.joint import JointModel
from hdcal.prediction.shares import share_findings
from hdcal.prediction.sizes import check_tolerances
from hdcal.report.item import Count, Draws, Item
from hdcal.report.item import quantity as labelled

Rule = Literal["guarded", "simple"]
RULES: tuple[Rule, ...] = get_args(Rule)
Share = Annotated[float, Field(gt=0.0, lt=1.0)]
# Temperatures of one answer, at each of which every draw has a force.
_MOST_TEMPERATURES = 1_000


class MarginRequest(Item):
    """Request of a margin.

    Attributes:
        direction: up to load, down to unload.
        loading_sense: +1 in compression, -1 in tension; capacities and what
            exceeds them are sizes along it, forces and bounds have their sign.
        quantity: reading of the rig, or load on the gear.
        population: readings, mountings or specimens.
        content: share of the population within each one-sided bound.
        confidence: of each bound.
        limit_force_N: capacity asked about, its size.
        tolerances_mm: ± of the sizes by name.
        given_force_N: force with its sign whose deformation is asked for.
        temperatures_C: of the specimen.
        rule: of the decision about the limit.
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


def checked_request(
    model: JointModel,
    deformation: float,
    temperature: Any,
    *,
    limit_force: float | None,
    given_force: float | None,
    content: float,
    confidence: float,
    population: Population | None,
    quantity: Quantity,
    direction: Direction,
    tolerances: Mapping[str, float] | None,
    rule: Rule | None,
    seed: int,
) -> MarginRequest:
    """Return the request that the arguments of `margin` make.

    Raises:
        InputError: holds everything that is wrong with them.
    """
    posterior, problem = model.posterior, model.problem
    case, sizes = posterior.case, dict(tolerances or {})
    warm = usual_temperature(case) if temperature is None else temperature
    numbers = {"deformation": deformation, "content": content, "confidence": confidence}
    numbers |= {"limit_force": limit_force, "given_force": given_force}
    with Findings() as wrong:
        for name, given in numbers.items():
            if given is not None and _axes(given) != 0:
                words, remedy = "is not one number", "Ask for one at a time"
                wrong.append(Finding(name, words, remedy))
        if _axes(warm) not in (0, 1):
            wrong.append(Finding("temperature", "is no list of numbers", "Give °C"))
    levels = np.atleast_1d(np.asarray(warm, float))
    loading = direction_of_loading(model, deformation)
    movement = loading * SENSE.get(direction, 0.0)
    population = population or widest(problem)
    with Findings() as wrong:
        impossible = [*_deformation(posterior, deformation, movement)]
        wrong += impossible
        wrong += _temperatures(model, levels)
        shares, more = (
            {"content": content, "confidence": confidence},
            ", or calibrate with more draws",
        )
        wrong += share_findings(shares, model.size, more)
        wrong += implausible("seed", seed)
        wrong += population_findings(population, problem)
        wrong += check_tolerances(sizes, case.gear.geometry, posterior.theory)
        # Beside a deformation that is refused no force looks right.
        if not impossible:
            for name in ("limit_force", "given_force"):
                wrong += _force(model, name, numbers[name], deformation, loading)
        for name, value, known in (
            ("quantity", quantity, QUANTITIES),
            ("direction", direction, DIRECTIONS),
            ("rule", rule or "guarded", RULES),
        ):
            if value not in known:
                remedy = f"Use {' or '.join(known)}"
                wrong.append(Finding(name, f"'{value}' is unknown", remedy))
        if rule is not None and limit_force is None:
            words, remedy = "decides nothing without a limit", "Give `limit_force` too"
            wrong.append(Finding("rule", words, remedy))
        if quantity == "load" and not _knows_contact(posterior):
            words = "needs the place of first contact, and the readings are far from 0"
            remedy = "State deformation_offset in [priors], or count from there"
            wrong.append(Finding("quantity", words, remedy))
    return MarginRequest(
        deformation_mm=float(deformation),
        direction=direction,
        loading_sense=loading,
        quantity=quantity,
        population=population,
        content=content,
        confidence=confidence,
        limit_force_N=None if limit_force is None else abs(limit_force),
        tolerances_mm={name: float(by) for name, by in sizes.items()},
        seed=seed,
        given_force_N=given_force,
        temperatures_C=levels,
        rule=rule or "guarded",
    )


def _axes(given: object) -> int | None:
    """Return the number of axes of numbers; None where it holds no numbers."""
    try:
        found = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        return None
    return None if isinstance(given, str) else found.ndim


def _deformation(
    posterior: Posterior, deformation: float, movement: float
) -> Iterator[Finding]:
    gear, units = posterior.case.gear, posterior.case.units
    tested = float(np.max(np.abs(posterior.case.records.deformation)))
    name, unit = "deformation", units.displacement_unit
    if wrong := implausible(name, deformation, units.displacement):
        yield from wrong
    elif deformation == 0.0:
        words = f"{deformation:g} {unit} is no {units.displacement}"
        yield Finding(name, words, f"Give a number of {unit}")
    elif wrong := far_findings(deformation, tested, gear.reach, unit):
        yield from wrong
    else:
        yield from excluded_findings(posterior.case, deformation, movement)


def _temperatures(model: JointModel, temperature: np.ndarray) -> list[Finding]:
    name = "temperature"
    if temperature.size == 0 or not np.isfinite(temperature).all():
        return [Finding(name, "is an empty window", "Give it like -20:80, in °C")]
    if temperature.size > _MOST_TEMPERATURES:
        words = f"{temperature.size} temperatures are too many"
        return [Finding(name, words, f"Give at most {_MOST_TEMPERATURES}")]
    return temperature_findings(model.posterior.case.gear, model.draws, temperature)


def _force(
    model: JointModel, name: str, force: float | None, at: float, loading: int
) -> Iterator[Finding]:
    units = model.posterior.case.units
    unit, place = units.load_unit, f"{at:g} {units.displacement_unit}"
    usual = abs(float(np.median(model.draws["stiffness"])) * at)
    if force is None:
        return
    if wrong := implausible(name, force):
        yield from wrong
    elif force == 0.0:
        words = f"{force:g} {unit} is no {units.load}"
        yield Finding(name, words, f"Give a number of {unit}")
    elif usual > 0.0 and not usual / OFF < abs(force) < usual * OFF:
        words = f"{force:g} {unit}, where {place} takes about {usual:.3g} {unit}"
        yield Finding(name, words, f"Give it in {unit}")
    elif name == "limit_force" and force < 0.0 < loading:
        words = f"{force:g} {unit} is no limit of the {units.load} at {place}, "
        remedy = f"Give {-force:g} {unit}, or ask at a negative {units.displacement}"
        yield Finding(name, words + "which is positive", remedy)


def _knows_contact(posterior: Posterior) -> bool:
    """Return whether the origin may be first contact, or the gear file states that."""
    name = "deformation_offset"
    stated = posterior.priors[name].source != rig_priors()[name].source
    return stated or not lies_far(posterior.case.records)
