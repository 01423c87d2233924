"""Bounds, capacities and probabilities from the draws of one cause or of several.

A bound with content p and confidence γ: in each draw the force that the share p of the
population does not exceed; of these over the draws the quantile γ. With a normal
population and the reference prior that is the classical tolerance limit exactly.

All of it is along the sense of loading; a `Level` has forces with their sign.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from scipy.special import ndtri

from hdcal.exported import jit
from hdcal.prediction.engine.causes import independent_draws
from hdcal.prediction.engine.loading_sense import (
    LoadingSense,
    ends_along,
    interval_along,
)
from hdcal.prediction.engine.mixture import Mixture, pooled, weighted_quantile
from hdcal.prediction.engine.population_force import PopulationForce
from hdcal.prediction.engine.reading_grid import ReadingGrid
from hdcal.prediction.margin.request import Criteria
from hdcal.prediction.margin.result import (
    INTERVAL,
    Exceedance,
    Level,
    ModelBound,
    sizes_needed,
)

# The least probability and the least distance to 1 that a number can hold.
LEAST, LEAST_LEFT = np.finfo(float).tiny, np.finfo(float).epsneg
_TAILS = (0.5 * (1.0 - INTERVAL), 0.5, 0.5 * (1.0 + INTERVAL))
_Bounded = TypeVar("_Bounded", Level, ModelBound)


@dataclass(frozen=True)
class PopulationDraws:
    """What every draw of all causes says of the population, along the sense.

    Attributes:
        sense: of loading.
        table: lower, upper and required quantile, centre [N] and the share above the
            limit; each [temperature, draw].
        weights: of the draws, sum 1.
        of_errors: the same times the root of the draws that an independent one takes.
        predicted: quantiles of the predictive law [temperature, share] [N]; the ends
            and the middle are of what is shown, all else is before rounding.
    """

    sense: LoadingSense
    table: Mapping[str, np.ndarray]
    weights: np.ndarray
    of_errors: np.ndarray
    predicted: np.ndarray


@jit
def _each_draw(mixture: Mixture, sense, shares, limit):
    """Return quantiles [draw] at each share, centre and share above the limit.

    Along the sense of loading.
    """
    mixture = mixture.along(sense)
    # One after the other: the program is a third as large.
    found = jax.lax.map(mixture.quantile, shares)
    size = mixture.mean.shape[:-1]
    above = mixture.above(jnp.broadcast_to(limit, size))
    return (*found, mixture.centre(), above)


@jit
def _predicted(parts, sense, rounding_sd, shown, exact):
    """Return quantiles of the law of all draws: as shown with rounding, and exact.

    Along the sense of loading, of mixtures with weights of their draws.
    """
    whole = pooled([(weight, part.along(sense)) for weight, part in parts])
    sd = [jnp.full(len(shown), rounding_sd), jnp.zeros(len(exact))]

    def quantile(asked):
        sd, share = asked
        return whole.widened(sd).quantile(share)

    return jax.lax.map(quantile, (jnp.concatenate(sd), jnp.append(shown, exact)))


def population_draws(
    forces: Sequence[PopulationForce], temperatures: np.ndarray, criteria: Criteria
) -> PopulationDraws:
    """Return what every draw of every cause says at temperatures [°C]."""
    wanted = np.array([1.0 - criteria.content, criteria.content, criteria.required])
    tails, required = np.array(_TAILS), np.array([criteria.required])
    limit = np.inf if criteria.limit_force is None else criteria.limit_force
    sense, rounding_sd = float(forces[0].sense), forces[0].rounding_sd
    weights = [force.cause.weights for force in forces]
    tables, predicted = [], []
    for warm in temperatures:
        found = [force.at(warm).mixture() for force in forces]
        each = [_each_draw(mixture, sense, wanted, limit) for mixture in found]
        tables.append([np.concatenate(c) for c in zip(*each, strict=True)])
        parts = list(zip(weights, found, strict=True))
        ahead = _predicted(parts, sense, rounding_sd, tails, required)
        predicted.append(np.asarray(ahead))
    names = ("lower", "upper", "required", "centre", "above")
    columns = {n: np.stack([t[i] for t in tables]) for i, n in enumerate(names)}
    each = [f.cause.size / independent_draws(f.cause) for f in forces]
    errors = [w * n**0.5 for w, n in zip(weights, each, strict=True)]
    about = np.concatenate(weights), np.concatenate(errors), np.stack(predicted)
    return PopulationDraws(forces[0].sense, columns, *about)


def level_of(
    draws: PopulationDraws, table, ahead, criteria: Criteria, warm, tested
) -> Level:
    """Put the draws of one temperature, or of the worst, together.

    Args:
        draws: of all causes.
        table: what they say there, a row of that of `draws`.
        ahead: the predictive quantiles there.
        criteria: what is to be kept.
        warm: the temperature [°C].
        tested: whether the data hold it.
    """

    def at(name: str, share: float) -> float:
        return weighted_quantile(table[name], draws.weights, share)

    low, middle, high = (at("centre", tail) for tail in _TAILS)
    ahead = [float(quantile) for quantile in ahead]
    bounds = at("lower", 1.0 - criteria.confidence), at("upper", criteria.confidence)
    lower, upper = ends_along(*bounds, draws.sense)
    limited = criteria.limit_force is not None
    return Level(
        temperature_C=warm,
        tested=tested,
        force_N=interval_along(middle, low, high, draws.sense),
        member_N=interval_along(ahead[1], ahead[0], ahead[2], draws.sense),
        lower_bound_N=lower,
        upper_bound_N=upper,
        capacity_N=at("required", criteria.confidence),
        capacity_median_N=at("required", 0.5),
        capacity_predictive_N=ahead[3],
        exceedance=_exceedance(table, draws, criteria) if limited else None,
    )


def shown(of: Level, grid: ReadingGrid, sense: LoadingSense) -> Level:
    """Return a level whose bounds and capacities are readings.

    Args:
        of: the level before rounding.
        grid: of the readings, along the sense.
        sense: of loading.
    """
    return replace(
        shown_bounds(of, grid, sense),
        capacity_N=grid.upper(of.capacity_N),
        capacity_median_N=grid.upper(of.capacity_median_N),
        capacity_predictive_N=grid.upper(of.capacity_predictive_N),
    )


def shown_bounds(of: _Bounded, grid: ReadingGrid, sense: LoadingSense) -> _Bounded:
    """Return the same with bounds that are readings."""
    least, most = ends_along(of.lower_bound_N, of.upper_bound_N, sense)
    lower, upper = ends_along(grid.lower(least), grid.upper(most), sense)
    return replace(of, lower_bound_N=lower, upper_bound_N=upper)


def _exceedance(table, draws: PopulationDraws, criteria: Criteria) -> Exceedance:
    above, weights = table["above"], draws.weights
    mean = float(np.sum(weights * above) / np.sum(weights))
    low, high, sure = (
        weighted_quantile(above, weights, share)
        for share in (_TAILS[0], _TAILS[2], criteria.confidence)
    )
    # Nobody can know that nothing or everything exceeds it.
    chances = np.clip([mean, low, high, sure], LEAST, 1.0 - LEAST_LEFT)
    beta, beta_hi, beta_lo, beta_sure = map(float, -ndtri(chances))
    betas = beta, beta_lo, beta_hi, beta_sure
    error = 1.0
    if mean > LEAST:
        # Of shares this small the squares may be zero.
        off = draws.of_errors * (above / mean - 1.0)
        error = float(np.linalg.norm(off) / np.sum(weights))
    mean, low, high, sure = map(float, chances)
    return Exceedance(mean, low, high, sure, *betas, error, None)


def worst_level(
    draws: PopulationDraws, criteria: Criteria, levels: Sequence[Level]
) -> Level:
    """Return what holds at every temperature at once: the worst one of each draw."""
    outer = [sizes_needed(level, draws.sense)[1] for level in levels]
    row = int(np.argmax(outer))
    worst = {name: table.max(axis=0) for name, table in draws.table.items()}
    worst["lower"] = draws.table["lower"].min(axis=0)
    worst["centre"] = draws.table["centre"][row]
    tested = all(level.tested for level in levels)
    predicted = draws.predicted[row].copy()
    predicted[3] = draws.predicted[:, 3].max()
    warm = levels[row].temperature_C
    return level_of(draws, worst, predicted, criteria, warm, tested)


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
                *ends_along(
                    weighted_quantile(low, even, 1.0 - criteria.confidence),
                    weighted_quantile(high, even, criteria.confidence),
                    draws.sense,
                ),
                None if criteria.limit_force is None else float(above),
            )
        )
        start += cause.size
    return tuple(found)
