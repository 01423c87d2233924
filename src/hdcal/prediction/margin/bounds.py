"""Bounds, capacities and probabilities from the draws of one model or of several.

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

from hdcal.inference.posterior import Posterior
from hdcal.prediction.margin.result import INTERVAL, Exceedance, Level, ModelBound
from hdcal.prediction.mixture import Mixture, pooled, weighted_quantile
from hdcal.prediction.population_force import Outlook
from hdcal.report.parameters import Interval

_TAILS = (0.5 * (1.0 - INTERVAL), 0.5, 0.5 * (1.0 + INTERVAL))


@dataclass(frozen=True)
class Asked:
    """What is asked of every draw.

    Attributes:
        content: share of the population within each bound.
        confidence: of each bound.
        required: probability that a capacity is to meet.
        limit: capacity [N], or None.
    """

    content: float
    confidence: float
    required: float
    limit: float | None


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


def content_bound(
    quantiles: np.ndarray,
    weights: np.ndarray,
    confidence: float,
) -> float:
    """Return what the quantile of the population does not exceed, with confidence.

    Args:
        quantiles: of the population in each draw, shape (d,).
        weights: of the draws, shape (d,).
        confidence: γ; of a lower bound 1 − γ.
    """
    return weighted_quantile(quantiles, weights, confidence)[0]


def level_of(
    draws: Mapping[str, np.ndarray], weights, asked: Asked, predicted, warm, tested
) -> Level:
    """Put the draws of one temperature, or of the worst, together."""

    def at(name: str, share: float) -> float:
        return content_bound(draws[name], weights, share)

    low, middle, high = (at("centre", tail) for tail in _TAILS)
    return Level(
        temperature_C=warm,
        tested=tested,
        force_N=Interval(middle, low, high),
        member_N=Interval(*(float(predicted[i]) for i in (1, 0, 2))),
        lower_bound_N=at("lower", 1.0 - asked.confidence),
        upper_bound_N=at("upper", asked.confidence),
        capacity_N=at("required", asked.confidence),
        capacity_predictive_N=float(predicted[3]),
        exceedance=None if asked.limit is None else _exceedance(draws, weights, asked),
    )


def _exceedance(draws, weights, asked: Asked) -> Exceedance:
    above = draws["above"]
    mean = float(np.sum(weights * above) / np.sum(weights))
    low, high, sure = (
        content_bound(above, weights, share)
        for share in (_TAILS[0], _TAILS[2], asked.confidence)
    )
    chances = np.clip([mean, low, high, sure], 0.0, 1.0)
    beta, beta_hi, beta_lo, beta_sure = map(float, -ndtri(chances))
    return Exceedance(
        probability=float(chances[0]),
        lo=float(chances[1]),
        hi=float(chances[2]),
        at_confidence=float(chances[3]),
        beta=beta,
        beta_lo=beta_lo,
        beta_hi=beta_hi,
        beta_at_confidence=beta_sure,
    )


@dataclass(frozen=True)
class Answers:
    """What the draws of all models answered.

    Attributes:
        draws: lower, upper, required, centre, above; each [temperature, draw].
        weights: of the draws, sum 1.
        predicted: quantiles of the predictive law [temperature, share] [N].
        sizes: number of draws of each model.
        temperatures: asked for [°C].
    """

    draws: dict[str, np.ndarray]
    weights: np.ndarray
    predicted: np.ndarray
    sizes: tuple[int, ...]
    temperatures: tuple[float, ...]


def ask(
    outlooks: Sequence[tuple[float, Outlook]], temperatures, asked: Asked
) -> Answers:
    """Put the questions to every draw of every model.

    Args:
        outlooks: of each model, with its probability.
        temperatures: of the specimen [°C].
        asked: the questions.
    """
    wanted = jnp.array([1.0 - asked.content, asked.content, asked.required])
    levels = jnp.array([*_TAILS, asked.required])
    limit = jnp.asarray(np.inf if asked.limit is None else asked.limit)
    weights = [
        np.full(size, share / size)
        for share, outlook in outlooks
        for size in [len(outlook.values["K"])]
    ]
    tables, predicted = [], []
    for warm in temperatures:
        found = [outlook.mixture(warm) for _, outlook in outlooks]
        each = [_each_draw(mixture, wanted, limit) for mixture in found]
        tables.append([np.concatenate(c) for c in zip(*each, strict=True)])
        parts = list(zip(map(jnp.asarray, weights), found, strict=True))
        predicted.append(np.asarray(_predicted(pooled(parts), levels)))
    names = ("lower", "upper", "required", "centre", "above")
    columns = {n: np.stack([t[i] for t in tables]) for i, n in enumerate(names)}
    return Answers(
        columns,
        np.concatenate(weights),
        np.stack(predicted),
        tuple(map(len, weights)),
        tuple(map(float, temperatures)),
    )


def worst_level(answers: Answers, asked: Asked, levels: Sequence[Level]) -> Level:
    """Return what holds at every temperature at once: the worst one of each draw."""
    hardest = max(levels, key=lambda level: level.upper_bound_N)
    row = levels.index(hardest)
    draws = {name: table.max(axis=0) for name, table in answers.draws.items()}
    draws["lower"] = answers.draws["lower"].min(axis=0)
    draws["centre"] = answers.draws["centre"][row]
    tested = all(level.tested for level in levels)
    predicted = answers.predicted[row].copy()
    predicted[3] = answers.predicted[:, 3].max()
    warm = hardest.temperature_C
    return level_of(draws, answers.weights, asked, predicted, warm, tested)


def model_bounds(
    outlooks: Sequence[tuple[float, Outlook]], answers: Answers, asked: Asked
) -> tuple[ModelBound, ...]:
    """Return what each of several models alone would say; of one nothing."""
    if len(outlooks) == 1:
        return ()
    found, start = [], 0
    for (share, outlook), size in zip(outlooks, answers.sizes, strict=True):
        rows = slice(start, start + size)
        even = np.ones(size)
        low = answers.draws["lower"][:, rows].min(axis=0)
        high = answers.draws["upper"][:, rows].max(axis=0)
        above = answers.draws["above"][:, rows].mean(axis=1).max()
        found.append(
            ModelBound(
                model_name(outlook.posterior),
                share,
                content_bound(low, even, 1.0 - asked.confidence),
                content_bound(high, even, asked.confidence),
                None if asked.limit is None else float(above),
            )
        )
        start += size
    return tuple(found)


def model_name(posterior: Posterior) -> str:
    """Return what a model is called among the hypotheses of a diagnosis."""
    effects = "+".join(sorted(effect.name for effect in posterior.effects))
    return effects or ("none" if posterior.problem.discrepancy is None else "unknown")
