"""Levels whose rare exceedances do not hang on a few draws of the sampler."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import ndtri

from hdcal.prediction.engine.population_force import PopulationForce
from hdcal.prediction.margin.bounds import (
    LEAST,
    LEAST_LEFT,
    PopulationDraws,
    model_bounds,
)
from hdcal.prediction.margin.rare import Rare, pooled_rare, rare
from hdcal.prediction.margin.request import Criteria
from hdcal.prediction.margin.result import Exceedance, Level, ModelBound

# Relative Monte Carlo error up to which a mean over the sampler's draws is good enough.
_ENOUGH = 0.1
# Relative Monte Carlo error beyond which a number is an order of magnitude.
_ROUGH = 0.3
# By how many times an assumption must move a probability to be told.
_TOLD = 1.5
# Of so many levels each is refined, of more the likeliest to exceed the limit.
_EACH = 12


def refined(
    levels: Sequence[Level],
    forces: Sequence[PopulationForce],
    limit: float | None,
    seed: int,
) -> tuple[Level, ...]:
    """Return levels whose probability of exceedance does not hang on a few draws.

    Args:
        levels: of all causes, one for each temperature.
        forces: of each cause.
        limit: along the sense of loading [N], or None.
        seed: of the points.
    """
    risks = [level.exceedance for level in levels if level.exceedance is not None]
    if limit is None or len(risks) < len(levels):
        return tuple(levels)
    top = int(np.argmax([risk.probability for risk in risks]))
    rows = range(len(levels)) if len(levels) <= _EACH else [top]
    better = list(levels)
    for row in rows:
        there = [force.at(levels[row].temperature_C) for force in forces]
        better[row] = replace(
            levels[row], exceedance=_refined(risks[row], there, limit, seed)
        )
    return tuple(better)


def with_likeliest(worst: Level, levels: Sequence[Level]) -> Level:
    """Return the worst level with the largest probability, where that was refined."""
    risks = [level.exceedance for level in levels if level.exceedance is not None]
    top = max(risks, key=lambda risk: risk.probability, default=None)
    if worst.exceedance is None or top is None or top.rests_on is None:
        return worst
    known = replace(
        worst.exceedance,
        probability=top.probability,
        beta=top.beta,
        relative_error=top.relative_error,
        rests_on=top.rests_on,
    )
    return replace(worst, exceedance=known)


def refined_models(
    forces: Sequence[PopulationForce],
    draws: PopulationDraws,
    criteria: Criteria,
    worst: Level,
    seed: int,
) -> tuple[ModelBound, ...]:
    """Return what each model alone says, also of an event that all make rare.

    Args:
        forces: of each cause.
        draws: what they say of the population.
        criteria: what is to be kept.
        worst: what all say together.
        seed: of the points.
    """
    models, risk = model_bounds(forces, draws, criteria), worst.exceedance
    if criteria.limit_force is None or risk is None or risk.rests_on is None:
        return models
    found = []
    for model, force in zip(models, forces, strict=False):
        there = force.at(worst.temperature_C)
        with np.errstate(all="ignore"):
            one = rare(there, criteria.limit_force, seed)
        chance = model.probability_exceeded
        if one.relative_error < _ROUGH:
            chance = float(np.clip(one.probability, LEAST, 1.0 - LEAST_LEFT))
        found.append(replace(model, probability_exceeded=chance))
    return tuple(found)


def _refined(
    risk: Exceedance, forces: Sequence[PopulationForce], limit: float, seed: int
) -> Exceedance:
    if risk.relative_error <= _ENOUGH:
        return risk
    # What cannot be computed stays what was counted.
    with np.errstate(all="ignore"):
        each = [(force.cause.probability, rare(force, limit, seed)) for force in forces]
        found = pooled_rare(each)
    if not found.relative_error < risk.relative_error:
        return risk
    chance = float(np.clip(found.probability, LEAST, 1.0 - LEAST_LEFT))
    return replace(
        risk,
        probability=chance,
        beta=float(-ndtri(chance)),
        relative_error=found.relative_error,
        rests_on=rests_on(found),
    )


def _times(factor: float) -> str:
    if factor >= 1e6:
        return "more than a million times"
    return f"{float(f'{factor:.2g}'):g} times"


def rests_on(found: Rare) -> str:
    """Say what a rare exceedance rests on."""
    error = f"{100.0 * found.relative_error:.0f} %"
    told = f"Its Monte Carlo error is {error}, by importance sampling"
    if found.relative_error > _ROUGH:
        told += ": no more than its order of magnitude is known"
    rests = []
    if found.heavy_tailed > _TOLD:
        rests.append(
            "the normal law of the scatter (by Student's t of five degrees of freedom "
            f"it were {_times(found.heavy_tailed)} as probable)"
        )
    moved = found.without_prior
    if moved > _TOLD or moved < 1.0 / _TOLD:
        rests.append(
            f"the prior of the noise (without one it were {_times(moved)} as probable)"
        )
    return f"{told}." + (f" It rests on {' and on '.join(rests)}." if rests else "")
