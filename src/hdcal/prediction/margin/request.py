"""Request of a margin, and what is wrong with one."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

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
    excluded_findings,
    far_findings,
    temperature_findings,
)
from hdcal.prediction.forces import QUANTITIES, Quantity
from hdcal.prediction.models import Model
from hdcal.prediction.population import Population, population_findings
from hdcal.prediction.shares import share_findings
from hdcal.prediction.sizes import check_tolerances
from hdcal.quantities import Quantities

Rule = Literal["guarded", "simple"]
RULES: tuple[Rule, ...] = get_args(Rule)
# Temperatures of one answer, at each of which every draw has a force.
_MOST_TEMPERATURES = 1_000


@dataclass(frozen=True, kw_only=True)
class MarginRequest:
    """Request of a margin; the attributes are those of `margin`.

    Attributes:
        temperature: of the specimen [°C], (t,).
        direction_of_loading: +1 in compression, -1 in tension.
        limit_force: size of the capacity [N], or None.
    """

    deformation: float
    temperature: np.ndarray
    direction_of_loading: int
    limit_force: float | None
    given_force: float | None
    content: float
    confidence: float
    required: float
    population: Population
    quantity: Quantity
    direction: Direction
    tolerances: Mapping[str, float]
    rule: Rule
    seed: int


def require_numbers(temperature, **asked) -> None:
    """Check that each question is about one number.

    Raises:
        InputError: it is not.
    """
    with Findings() as wrong:
        for name, given in asked.items():
            if given is not None and _axes(given) != 0:
                words, remedy = "is not one number", "Ask for one at a time"
                wrong.append(Finding(name, words, remedy))
        if temperature is not None and _axes(temperature) not in (0, 1):
            wrong.append(Finding("temperature", "is no list of numbers", "Give °C"))


def _axes(given: object) -> int | None:
    """Return the number of axes of numbers; None where it holds no numbers."""
    try:
        found = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        return None
    return None if isinstance(given, str) else found.ndim


def require_answerable(
    models: Sequence[Model],
    asked: MarginRequest,
    limit_force: float | None,
    rule: str | None,
) -> None:
    """Check a request, all of it at once.

    Args:
        models: the most probable first.
        asked: the request.
        limit_force: as given, with its sign.
        rule: as given.

    Raises:
        InputError: holds every finding.
    """
    main, posterior = models[0], models[0].posterior
    case, gear, at = posterior.case, posterior.case.gear, asked.deformation
    movement = asked.direction_of_loading * SENSE.get(asked.direction, 0.0)
    with Findings() as wrong:
        impossible = [*_deformation(posterior, at, movement)]
        wrong += impossible
        wrong += _temperatures(main, asked.temperature)
        shares = {"content": asked.content, "confidence": asked.confidence}
        if asked.required != asked.content:
            shares["required_probability"] = asked.required
        wrong += share_findings(
            shares,
            sum(model.size for model in models),
            ", or calibrate with more draws",
        )
        wrong += implausible("seed", asked.seed)
        wrong += population_findings(asked.population, main.problem)
        wrong += check_tolerances(asked.tolerances, gear.geometry, posterior.theory)
        # Beside a deformation that is refused no force looks right.
        if not impossible:
            wrong += _forces(main, asked, limit_force, case.units)
        wrong += _choices(asked, rule)
        if asked.quantity == "load" and not _knows_contact(posterior):
            words = "needs the place of first contact, and the readings are far from 0"
            remedy = "State deformation_offset in [priors], or count from there"
            wrong.append(Finding("quantity", words, remedy))


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


def _temperatures(main: Model, temperature: np.ndarray) -> list[Finding]:
    name = "temperature"
    if temperature.size == 0 or not np.isfinite(temperature).all():
        return [Finding(name, "is an empty window", "Give it like -20:80, in °C")]
    if temperature.size > _MOST_TEMPERATURES:
        words = f"{temperature.size} temperatures are too many"
        return [Finding(name, words, f"Give at most {_MOST_TEMPERATURES}")]
    return temperature_findings(main.posterior.case.gear, main.draws, temperature)


def _forces(
    main: Model, asked: MarginRequest, limit_force: float | None, units: Quantities
) -> Iterator[Finding]:
    at, unit = asked.deformation, units.load_unit
    usual = abs(float(np.median(main.draws["stiffness"])) * at)
    for name, force in (
        ("limit_force", limit_force),
        ("given_force", asked.given_force),
    ):
        if force is None:
            continue
        if wrong := implausible(name, force):
            yield from wrong
        elif force == 0.0:
            words = f"{force:g} {unit} is no {units.load}"
            yield Finding(name, words, f"Give a number of {unit}")
        elif usual > 0.0 and not usual / OFF < abs(force) < usual * OFF:
            place = f"{at:g} {units.displacement_unit}"
            words = f"{force:g} {unit}, where {place} takes about {usual:.3g} {unit}"
            yield Finding(name, words, f"Give it in {unit}")
        elif name == "limit_force" and force < 0.0 < asked.direction_of_loading:
            words = f"{force:g} {unit} is no limit of the {units.load} at "
            words += f"{at:g} {units.displacement_unit}, which is positive"
            remedy = f"Give {-force:g} {unit}, or ask at a negative "
            yield Finding(name, words, remedy + units.displacement)


def _choices(asked: MarginRequest, rule: str | None) -> Iterator[Finding]:
    for name, value, known in (
        ("quantity", asked.quantity, QUANTITIES),
        ("direction", asked.direction, DIRECTIONS),
        ("rule", asked.rule, RULES),
    ):
        if value not in known:
            remedy = f"Use {' or '.join(known)}"
            yield Finding(name, f"'{value}' is unknown", remedy)
    if rule is not None and asked.limit_force is None:
        words, remedy = "decides nothing without a limit", "Give `limit_force` too"
        yield Finding("rule", words, remedy)


def _knows_contact(posterior: Posterior) -> bool:
    """Return whether the origin may be first contact, or the gear file states that."""
    name = "deformation_offset"
    stated = posterior.priors[name].source != rig_priors()[name].source
    return stated or not lies_far(posterior.case.records)
