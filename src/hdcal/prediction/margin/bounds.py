"""Bounds, capacities and probabilities from the draws of one cause or of several.

A bound with content p and confidence γ: in each draw the force that the share p of the
population does not exceed; of these over the draws the quantile γ. With a normal
population and the reference prior that is the classical tolerance limit exactly.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from scipy.special import ndtri

from hdcal.prediction.engine.mixture import Mixture, pooled, weighted_quantile
from hdcal.prediction.engine.population_force import PopulationForce
from hdcal.prediction.margin.request import Criteria
from hdcal.prediction.margin.result import INTERVAL, Exceedance, Level, ModelBound
from hdcal.report.parameters import Interval

_TAILS = (0.5 * (1.0 - INTERVAL), 0.5, 0.5 * (1.0 + INTERVAL))


@dataclass(frozen=True)
class PopulationDraws:
    """What every draw of all causes says of the population.

    Attributes:
        table: lower, upper and required quantile, centre [N] and the share above the
            limit; each [temperature, draw].
        weights: of the draws, sum 1.
        predicted: quantiles of the predictive law [temperature, share] [N].
    """

    table: Mapping[str, np.ndarray]
    weights: np.ndarray
    predicted: np.ndarray


@jax.jit
def _each_draw(mixture: Mixture, shares, limit):
    """Return quantiles [draw] at each share, centre and share above the limit."""
    found = [mixture.quantile(share) for share in shares]
    size = mixture.mean.shape[:-1]
    above = mixture.above(jnp.broadcast_to(limit, size))
    return (*found, mixture.centre(), above)


@jax.jit
def _predicted(mixture: Mixture, shares):
    return jax.lax.map(mixture.quantile, shares)


def population_draws(
    forces: Sequence[PopulationForce], temperatures: np.ndarray, criteria: Criteria
) -> PopulationDraws:
    """Return what every draw of every cause says at temperatures [°C]."""
    wanted = jnp.array([1.0 - criteria.content, criteria.content, criteria.required])
    levels = jnp.array([*_TAILS, criteria.required])
    limit = jnp.asarray(
        np.inf if criteria.limit_force is None else criteria.limit_force
    )
    weights = [force.cause.weights for force in forces]
    tables, predicted = [], []
    for warm in temperatures:
        found = [force.at(warm).mixture() for force in forces]
        each = [_each_draw(mixture, wanted, limit) for mixture in found]
        tables.append([np.concatenate(c) for c in zip(*each, strict=True)])
        parts = list(zip(map(jnp.asarray, weights), found, strict=True))
        predicted.append(np.asarray(_predicted(pooled(parts), levels)))
    names = ("lower", "upper", "required", "centre", "above")
    columns = {n: np.stack([t[i] for t in tables]) for i, n in enumerate(names)}
    return PopulationDraws(columns, np.concatenate(weights), np.stack(predicted))


def level_of(
    draws: Mapping[str, np.ndarray], weights, criteria: Criteria, ahead, warm, tested
) -> Level:
    """Put the draws of one temperature, or of the worst, together.

    Args are a row of the table, weights and predictive law of `PopulationDraws`.
    """

    def at(name: str, share: float) -> float:
        return weighted_quantile(draws[name], weights, share)

    low, middle, high = (at("centre", tail) for tail in _TAILS)
    limited = criteria.limit_force is not None
    return Level(
        temperature_C=warm,
        tested=tested,
        force_N=Interval(middle, low, high),
        member_N=Interval(*(float(ahead[i]) for i in (1, 0, 2))),
        lower_bound_N=at("lower", 1.0 - criteria.confidence),
        upper_bound_N=at("upper", criteria.confidence),
        capacity_N=at("required", criteria.confidence),
        capacity_predictive_N=float(ahead[3]),
        exceedance=_exceedance(draws, weights, criteria) if limited else None,
    )


def _exceedance(draws, weights, criteria: Criteria) -> Exceedance:
    above = draws["above"]
    mean = float(np.sum(weights * above) / np.sum(weights))
    low, high, sure = (
        weighted_quantile(above, weights, share)
        for share in (_TAILS[0], _TAILS[2], criteria.confidence)
    )
    chances = np.clip([mean, low, high, sure], 0.0, 1.0)
    beta, beta_hi, beta_lo, beta_sure = map(float, -ndtri(chances))
    mean, low, high, sure = map(float, chances)
    return Exceedance(mean, low, high, sure, beta, beta_lo, beta_hi, beta_sure)


def worst_level(
    draws: PopulationDraws, criteria: Criteria, levels: Sequence[Level]
) -> Level:
    """Return what holds at every temperature at once: the worst one of each draw."""
    hardest = max(levels, key=lambda level: level.upper_bound_N)
    row = levels.index(hardest)
    worst = {name: table.max(axis=0) for name, table in draws.table.items()}
    worst["lower"] = draws.table["lower"].min(axis=0)
    worst["centre"] = draws.table["centre"][row]
    tested = all(level.tested for level in levels)
    predicted = draws.predicted[row].copy()
    predicted[3] = draws.predicted[:, 3].max()
    warm = hardest.temperature_C
    return level_of(worst, draws.weights, criteria, predicted, warm, tested)


def model_bounds(
    forces: Sequence[PopulationForce], draws: PopulationDraws, criteria: Criteria
) -> tuple[ModelBound, ...]:
    """Return what each of several causes alone would say; of one nothing."""
    if len(forces) == 1:
        return ()
    found, start = [], 0
    for cause in (force.cause for force in forces):
        rows = slice(start, start + cause.size)
        even = np.ones(cause.size)
        low = draws.table["lower"][:, rows].min(axis=0)
        high = draws.table["upper"][:, rows].max(axis=0)
        above = draws.table["above"][:, rows].mean(axis=1).max()
        found.append(
            ModelBound(
                cause.name,
                cause.probability,
                weighted_quantile(low, even, 1.0 - criteria.confidence),
                weighted_quantile(high, even, criteria.confidence),
                None if criteria.limit_force is None else float(above),
            )
        )
        start += cause.size
    return tuple(found)
