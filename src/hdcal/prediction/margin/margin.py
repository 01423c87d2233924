"""Margins: the force that a deformation needs, for how many of whom, how surely."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from hdcal.errors import Finding, InputError
from hdcal.prediction.engine.causes import (
    Cause,
    causes_of,
    chances_of,
    likeliest,
    weight_left_out,
)
from hdcal.prediction.engine.conditions import (
    SENSE,
    Direction,
    beyond_tested,
    is_tested,
)
from hdcal.prediction.engine.forces import Quantity
from hdcal.prediction.engine.loading_sense import (
    LoadingSense,
    loading_sense,
    sense_of,
)
from hdcal.prediction.engine.models import Models
from hdcal.prediction.engine.population import Population, widest
from hdcal.prediction.engine.population_force import PopulationForce, population_force
from hdcal.prediction.engine.reading_grid import ReadingGrid, reading_grid
from hdcal.prediction.engine.sizes import SIZES
from hdcal.prediction.margin.bounds import (
    PopulationDraws,
    level_of,
    population_draws,
    shown,
    shown_bounds,
    worst_level,
)
from hdcal.prediction.margin.checks import check_margin, check_sign
from hdcal.prediction.margin.decision import decision
from hdcal.prediction.margin.deformation_reached import (
    DeformationReached,
    deformation_reached,
)
from hdcal.prediction.margin.gradients import gradients
from hdcal.prediction.margin.refined import (
    refined,
    refined_models,
    with_likeliest,
)
from hdcal.prediction.margin.remarks import (
    extrapolations,
    population_words,
    remarks,
)
from hdcal.prediction.margin.request import Criteria, MarginRequest
from hdcal.prediction.margin.result import FAR, Level, Margin, ModelBound
from hdcal.prediction.margin.stated import Rule
from hdcal.prediction.margin.temperatures import levels_between, nodes_of
from hdcal.prediction.margin.uncertainty import stated_uncertainty
from hdcal.prediction.margin.variance_shares import variance_shares
from hdcal.prediction.shares import BASES
from hdcal.report.document import mapped


def margin(
    models: Models,
    deformation: float,
    *,
    temperature: float | Sequence[float] | np.ndarray | None = None,
    limit_force: float | None = None,
    given_force: float | None = None,
    content: float = 0.99,
    confidence: float = 0.95,
    required_probability: float | None = None,
    population: Population | None = None,
    quantity: Quantity = "reading",
    direction: Direction = "up",
    tolerances: Mapping[str, float] | None = None,
    sensitivities: bool = True,
    seed: int = 0,
    rule: Rule | None = None,
) -> Margin:
    """Return the force needed at a deformation, with bounds, and the margin to it.

    Args:
        models: a posterior, or several with the probabilities of their models.
        deformation: as read [mm].
        temperature: of the specimen [°C]; of several the worst counts. By default
            the tested one nearest to the reference.
        limit_force: capacity [N], a size along the sense of loading, or with its sign.
        given_force: force [N] whose deformation is asked for, with its sign.
        content: share of the population within each one-sided bound.
        confidence: of each bound.
        required_probability: that a capacity is to meet; the content by default.
        population: whose force; by default the widest that the data support.
        quantity: `reading` of the rig's gauge, or `load` on the gear.
        direction: up to load, away from the unloaded gear; down to unload.
        tolerances: ± by wall_thickness_mm, radius_mm, length_mm, load_height_mm.
        sensitivities: with gradients, the budget and shares of the variance.
        seed: of what the data leave open about the population's centre.
        rule: of the decision about the limit, guarded (by default) or simple.

    Returns:
        Bounds by temperature and over all of them; every interval says its kind.

    Raises:
        NotUsable: a calibration failed its checks.
        InputError: what is asked cannot be answered; holds every finding.
    """
    asked = {"deformation": deformation, "limit_force": limit_force}
    asked |= {"given_force": given_force, "content": content, "confidence": confidence}
    asked |= {"required_probability": required_probability}
    optional = {"limit_force", "given_force", "required_probability"}
    wrong = [
        Finding(name, "is not one number", "Ask for one at a time")
        for name, given in asked.items()
        if _axes(given) != 0 and not (given is None and name in optional)
    ]
    if temperature is not None and _axes(temperature) not in (0, 1):
        wrong.append(Finding("temperature", "is no list of numbers", "Give degrees C"))
    if wrong:
        raise InputError(wrong)
    sizes = {name: float(width) for name, width in (tolerances or {}).items()}
    about = direction, sizes, population, quantity, given_force, seed
    request = MarginRequest(deformation, temperature, *about)
    criteria = Criteria(content, confidence, required_probability, limit_force, rule)
    return _margin(causes_of(models), request, criteria, sensitivities)


def _axes(given: object) -> int | None:
    """Return the number of axes of numbers, None of what is none."""
    try:
        found = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        return None
    return None if given is None or isinstance(given, str) else found.ndim


def _margin(
    causes: Sequence[Cause],
    request: MarginRequest,
    criteria: Criteria,
    sensitivities: bool,
) -> Margin:
    main, sense = likeliest(causes), loading_sense(causes, request.deformation)
    units = main.posterior.case.units
    warm = request.temperatures(main.posterior.case)
    check_margin(causes, request, warm, criteria, sense)
    criteria = criteria.of_size()
    whose = request.population or widest(main.problem)
    forces = _forces(causes, request, whose, sense)
    grid = _grid(forces, sense)
    unrounded = criteria.before_rounding(grid)
    answered = _answered(forces, request, unrounded, warm)
    check_sign(answered.computed, request, criteria, sense, units)
    worst = shown(answered.worst, grid, sense)
    there = [force.at(worst.temperature_C) for force in forces]
    stated = stated_uncertainty(there, worst, with_budget=sensitivities)
    found = Margin(
        **vars(stated),
        deformation_mm=float(request.deformation),
        direction=request.direction,
        loading_sense=sense,
        quantity=request.quantity,
        population=whose,
        population_words=population_words(whose, main.problem),
        basis=_basis(whose, criteria, forces[0]),
        content=criteria.content,
        confidence=criteria.confidence,
        required_probability=criteria.required,
        limit_force_N=criteria.limit_force,
        tolerances_mm=request.tolerances,
        levels=tuple(shown(level, grid, sense) for level in answered.levels),
        worst=worst,
        reached=_reached(there, request, criteria),
        decision=decision(stated, worst, criteria, unrounded, sense, there),
        models=tuple(shown_bounds(model, grid, sense) for model in answered.models),
        causes=chances_of(causes),
        weight_left_out=weight_left_out(causes),
        gradients=gradients(there, answered.upper, criteria) if sensitivities else (),
        shares=variance_shares(there, request.seed) if sensitivities else (),
        beyond_tested=beyond_tested(forces[0].conditions),
        extrapolated=extrapolations(forces, warm),
        remarks=remarks(forces, answered.computed, worst, criteria, grid),
        units=units,
    )
    return mapped(found, units.say)


class _Answered(NamedTuple):
    """What holds at each temperature, of the force before it is rounded.

    Attributes:
        computed: at the computed temperatures.
        levels: at all that were asked for.
        worst: of all of them.
        models: what each of several causes alone would say.
        upper: of each draw the upper bound at the worst temperature [N].
    """

    computed: tuple[Level, ...]
    levels: tuple[Level, ...]
    worst: Level
    models: tuple[ModelBound, ...]
    upper: np.ndarray


def _answered(
    forces: Sequence[PopulationForce], request: MarginRequest, criteria: Criteria, warm
) -> _Answered:
    main, sense = likeliest([force.cause for force in forces]), forces[0].sense
    nodes = nodes_of(warm, main.posterior.case.records)
    draws = population_draws(forces, nodes, criteria)
    computed = _levels(draws, main, request, nodes, criteria)
    levels = levels_between(computed, warm, _tested(main, request, sense, warm))
    levels = refined(levels, forces, criteria.limit_force, request.seed)
    worst = with_likeliest(worst_level(draws, criteria, computed), levels)
    models = refined_models(forces, draws, criteria, worst, request.seed)
    upper = draws.table["upper"][list(nodes).index(worst.temperature_C)]
    return _Answered(computed, levels, worst, models, upper)


def _forces(
    causes: Sequence[Cause],
    request: MarginRequest,
    whose: Population,
    sense: LoadingSense,
) -> list[PopulationForce]:
    """Return the forces that each cause expects."""
    about = {
        "quantity": request.quantity,
        "direction": request.direction,
        "sense": sense,
        "tolerances": {SIZES[n]: t for n, t in request.tolerances.items() if t > 0.0},
        "seed": request.seed,
    }
    return [population_force(c, request.deformation, whose, **about) for c in causes]


def _levels(
    draws: PopulationDraws, main: Cause, request: MarginRequest, warm, criteria
) -> tuple[Level, ...]:
    """Return what holds at each temperature [°C]."""
    tested = _tested(main, request, draws.sense, warm)
    tables = [{n: t[i] for n, t in draws.table.items()} for i in range(len(warm))]
    places = zip(tables, draws.predicted, warm, tested, strict=True)
    return tuple(
        level_of(draws, table, ahead, criteria, float(at), bool(inside))
        for table, ahead, at, inside in places
    )


def _reached(
    there: Sequence[PopulationForce], request: MarginRequest, criteria: Criteria
) -> DeformationReached | None:
    given = request.given_force
    if given is None:
        return None
    grid = _grid(there, sense_of(given))
    return deformation_reached(there, given, criteria, grid)


def _grid(forces: Sequence[PopulationForce], sense: LoadingSense) -> ReadingGrid:
    """Return what readings are rounded to along a sense."""
    first = forces[0]
    case = first.cause.posterior.case
    return reading_grid(case, sense, rounded=first.whose.rounded)


def _tested(main: Cause, request: MarginRequest, sense, warm) -> np.ndarray:
    """Tell at which temperatures [°C] the data hold what is asked for."""
    return is_tested(
        main.posterior.case.records,
        deformation=request.deformation,
        temperature=warm,
        sense=sense * SENSE[request.direction],
    )


def _basis(population: Population, criteria: Criteria, force: PopulationForce) -> str:
    """Return the name of such a bound, of gears whose deformation was tested.

    It has none where the prior tells how much gears differ.
    """
    beyond = beyond_tested(force.conditions)
    scatter = force.cause.posterior.diagnoses.get("specimen_sd")
    by_prior = scatter is not None and scatter.driven_by == "prior"
    if population != "specimens" or beyond > FAR or by_prior:
        return ""
    pair = (criteria.content, criteria.confidence)
    return next((name for name, shares in BASES.items() if shares == pair), "")
