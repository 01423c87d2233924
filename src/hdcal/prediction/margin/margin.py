"""Margins: the force that a deformation needs, for how many of whom, how surely."""

from collections.abc import Mapping, Sequence

import numpy as np

from hdcal.inference.posterior import Posterior
from hdcal.prediction.bands.bands import Direction
from hdcal.prediction.forces import Quantity
from hdcal.prediction.margin.bounds import (
    Answers,
    Asked,
    ask,
    level_of,
    model_bounds,
    worst_level,
)
from hdcal.prediction.margin.checks import Models, check_margin, usable_members
from hdcal.prediction.margin.deformation_reached import reach
from hdcal.prediction.margin.document import population_words
from hdcal.prediction.margin.gradients import gradients
from hdcal.prediction.margin.remarks import extrapolations, is_tested, remarks
from hdcal.prediction.margin.result import Margin
from hdcal.prediction.margin.variance_shares import shares
from hdcal.prediction.population import Population, widest
from hdcal.prediction.population_force import MOST_DRAWS, Outlook, Question, look_out
from hdcal.prediction.size_tolerances import tolerance_nodes
from hdcal.prediction.tolerance_factors import BASES

# A content beyond this only the normal law tells.
_TAIL = 0.9999


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
) -> Margin:
    """Return the force needed at a deformation, with bounds, and the margin to it.

    Args:
        models: a posterior, or several with the probabilities of their models.
        deformation: as read [mm].
        temperature: of the specimen [°C], one or several; the worst of them counts.
            By default the tested one nearest to the reference.
        limit_force: capacity [N] whose exceedance is asked for.
        given_force: force [N] whose deformation is asked for.
        content: share of the population within each one-sided bound.
        confidence: of each bound.
        required_probability: that a capacity is to meet; the content by default.
        population: whose force; by default the widest that the data support.
        quantity: `reading` of the rig's gauge, or `load` on the gear.
        direction: of the movement.
        tolerances: ± by wall_thickness_mm, radius_mm, length_mm, load_height_mm.
        sensitivities: with gradients and shares of the variance.
        seed: of what the data leave open about the population's centre.

    Returns:
        Bounds by temperature and over all of them; every interval says its kind.

    Raises:
        NotUsable: a calibration failed its checks.
        InputError: what is asked cannot be answered; holds every finding.
    """
    members = usable_members(models)
    likeliest = max(members, key=lambda member: member[0])[1]
    required = content if required_probability is None else required_probability
    warm = _temperatures(likeliest, temperature)
    named = {n: float(t) for n, t in (tolerances or {}).items()}
    check_margin(
        likeliest,
        deformation=deformation,
        temperature=warm,
        forces={"limit_force": limit_force, "given_force": given_force},
        shares={"content": content, "confidence": confidence}
        | ({} if required_probability is None else {"required_probability": required}),
        draws=sum(min(len(m.draws["K"]), MOST_DRAWS) for _, m in members),
        population=population,
        quantity=quantity,
        direction=direction,
        tolerances=named,
    )
    whose = population or widest(likeliest.problem)
    by_field = {n.removesuffix("_mm"): t for n, t in named.items() if t > 0.0}
    outlooks = [
        (
            share,
            _outlook(model, deformation, direction, whose, quantity, by_field, seed),
        )
        for share, model in members
    ]
    asked = Asked(content, confidence, required, limit_force)
    answers = ask(outlooks, warm, asked)
    levels = tuple(
        level_of(
            {name: table[i] for name, table in answers.draws.items()},
            answers.weights,
            asked,
            answers.predicted[i],
            float(t),
            is_tested(likeliest, deformation, t, direction == "down"),
        )
        for i, t in enumerate(warm)
    )
    worst = worst_level(answers, asked, levels)
    reached = None
    if given_force is not None:
        reached = reach(outlooks, given_force, worst.temperature_C, content, confidence)
    slopes, parts = (), ()
    if sensitivities:
        slopes, parts = _sensitivities(outlooks, answers, worst, by_field, asked, seed)
    chance = worst.exceedance and worst.exceedance.probability
    main = next(o for _, o in outlooks if o.posterior is likeliest)
    ordered = [(1.0, main), *((s, o) for s, o in outlooks if o is not main)]
    return Margin(
        deformation_mm=float(deformation),
        direction=direction,
        quantity=quantity,
        population=whose,
        population_words=population_words(whose, likeliest.problem),
        basis=_basis(whose, content, confidence),
        content=content,
        confidence=confidence,
        required_probability=required,
        limit_force_N=limit_force,
        tolerances_mm=named,
        levels=levels,
        worst=worst,
        reached=reached,
        models=model_bounds(outlooks, answers, asked),
        gradients=slopes,
        shares=parts,
        extrapolated=extrapolations(main, warm),
        remarks=remarks(ordered, chance, max(content, required) > _TAIL),
    )


def _temperatures(posterior: Posterior, asked) -> np.ndarray:
    if asked is not None:
        return np.atleast_1d(np.asarray(asked, dtype=float))
    measured = posterior.case.records.temperature
    reference = posterior.case.gear.reference_temperature
    return np.atleast_1d(np.clip(reference, np.min(measured), np.max(measured)))


def _outlook(
    model: Posterior, deformation, direction, population, quantity, tolerances, seed
) -> Outlook:
    records, geometry = model.case.records, model.case.gear.geometry
    low, high = float(records.deformation.min()), float(records.deformation.max())
    question = Question(
        deformation=float(deformation),
        # Down from the largest deformation tested, or from where it is asked for.
        turn=max(high, float(deformation)),
        # A new reading is as good as the tested ones were on average.
        known_sd=float(np.sqrt(np.mean(records.force_sd**2))),
        low=low,
        high=high,
        down=direction == "down",
    )
    return look_out(
        model,
        question,
        population=population,
        quantity=quantity,
        nodes=tolerance_nodes(geometry, tolerances, model.theory),
        seed=seed,
    )


def _sensitivities(outlooks, answers: Answers, worst, tolerances, asked: Asked, seed):
    """Return gradients and shares at the worst temperature."""
    warm = worst.temperature_C
    row = answers.temperatures.index(warm)
    slopes = gradients(
        outlooks,
        warm,
        tolerances,
        answers.draws["upper"][row],
        answers.weights,
        asked.content,
        asked.confidence,
    )
    return slopes, shares(outlooks, warm, tolerances, seed)


def _basis(population: Population, content: float, confidence: float) -> str:
    """Return the name that a bound of these shares has, if of a population of gears."""
    if population != "specimens":
        return ""
    pair = (content, confidence)
    return next((name for name, shares in BASES.items() if shares == pair), "")
