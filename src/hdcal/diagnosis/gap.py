"""The gap between base model and readings: row by row, and how far effects close it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from hdcal.data.records import Records
from hdcal.diagnosis.acting import ALIKE, direction
from hdcal.evidence.components import Components, components
from hdcal.evidence.evaluation import select
from hdcal.evidence.linear_problem import LinearProblem
from hdcal.evidence.noise_models import NoiseModel
from hdcal.evidence.parts import Part, join, posterior, sampled_curves
from hdcal.evidence.row_features import half_cycles, place_in_run
from hdcal.evidence.search import Searched
from hdcal.evidence.table import OUTSIDE, Names
from hdcal.physics.effects.scatter import Scatter
from hdcal.report.item import TAILS, Interval

# Draws of the gap, and of the share that closes.
_DRAWS, _SAMPLES = 600, 1000
# With fewer half cycles all rows are cut into stretches, six at most.
_FEWEST_HALVES, _MOST_STRETCHES = 4, 6


@dataclass(frozen=True)
class GapByRow:
    """What the base model leaves of the readings [N], and draws of the gap [N].

    The rows are those that were diagnosed, run after run: all, or one of several.
    """

    records: Records
    residual: Float[np.ndarray, " n"]
    draws: Float[np.ndarray, "d n"]


@dataclass(frozen=True)
class Fitted:
    """The likeliest hypothesis with some effects, fitted to all rows.

    `noise_sd` is that of a typical row [N]; `rms` what the base model leaves, then with
    each named effect in addition, then with a remainder and all other effects [N], by
    what was added last.
    """

    noise: NoiseModel
    noise_sd: float
    rms: Mapping[str, float]


def gap_by_row(
    searched: Searched,
    posterior_of: Mapping[Names, np.ndarray],
    rng: np.random.Generator,
) -> GapByRow:
    """Return residuals and posterior draws of the gap, over all hypotheses."""
    problem, table = searched.problem, searched.table
    keys = [*posterior_of]
    chance = np.array([posterior_of[key].sum() for key in keys])
    draws = [np.zeros((0, len(problem.y)))]
    for key, count in zip(keys, rng.multinomial(_DRAWS, chance), strict=True):
        noise, parts = table.likeliest_noise(key), table.parts[key]
        if count and not parts:
            draws.append(np.zeros((count, len(problem.y))))
        elif count:
            curves = sampled_curves(problem, noise, parts, int(count), rng)
            draws.append(curves.whole.sum(axis=0))
    # The gap is projected in the same way, so that it lies among the residuals.
    residual = problem.project(problem.y)
    return GapByRow(problem.records, residual, np.concatenate(draws))


def fitted(
    searched: Searched, posterior_of: Mapping[Names, np.ndarray], names: Sequence[str]
) -> Fitted:
    """Return the likeliest of the hypotheses that contain most of the named effects."""
    problem, table = searched.problem, searched.table
    key = max(
        posterior_of,
        key=lambda each: (len({*names} & {*each}), posterior_of[each].sum()),
    )
    noise, parts = table.likeliest_noise(key), table.parts[key]
    by_name = {table.names[part.component]: part for part in parts}
    named = [name for name in names if name in by_name]
    steps = {
        name: [by_name[n] for n in named[:k]] for k, name in enumerate(["", *named])
    }
    if OUTSIDE in by_name:
        steps[OUTSIDE] = parts
    rms = {}
    for name, some in steps.items():
        left = problem.y - posterior(problem, noise, some).reading
        rms[name] = float(np.sqrt(np.mean(left**2)))
    found = posterior(problem, noise, parts)
    left = (problem.y - found.reading) * noise.weight
    used = len(found.mean) - float(np.sum(found.factor**2))
    free = max(problem.count - used, 1.0)
    return Fitted(noise, float(np.sqrt(left @ left / free)), rms)


def nearest_effects(searched: Searched, fit: Fitted) -> tuple[tuple[str, ...], float]:
    """Return the effect that explains most of the gap alone, and its share of it.

    Effects whose curves coincide with its own follow it. The share is 1 − √(G₁/G₀), G
    the mean square of what is left beyond the noise of a fit, which weighs the rows.
    It is NaN where the base model leaves no more, or no effect was evaluated.
    """
    problem, table, left = searched.problem, searched.table, {}
    alone = [key for key in table.ranked(1) if key != (OUTSIDE,)]
    if not alone:
        return (), np.nan
    for key in [(), *alone]:
        found = posterior(problem, fit.noise, table.parts[key])
        square = np.mean(((problem.y - found.reading) * fit.noise.weight) ** 2)
        left[key] = float(square) - fit.noise_sd**2
    first, *others = sorted(alone, key=lambda key: left[key])
    curve = direction(searched, first, *first)
    alike = [k for k in others if curve @ direction(searched, k, *k) >= ALIKE]
    share = float(_closed(left[()], left[first]))
    return (*first, *(name for (name,) in alike)), share


def closed_on_left_out(
    searched: Searched, fit: Fitted, names: Sequence[str], rng: np.random.Generator
) -> tuple[Interval | None, str]:
    """Return the share of the gap that effects close on rows left out of the fit.

    The rows are left out block by block, in words what is returned too. Base model and
    effects are fitted to the others, the shapes of the effects included, with the noise
    of a fit to all. The share is 1 − √(G₁/G₀), G the mean square of what is left beyond
    the noise; its interval is over resampled blocks and the error of the noise sd. None
    where no block shows a gap.
    """
    problem = searched.problem
    effects = {name: searched.effects[name] for name in names}
    differ = any(issubclass(effect, Scatter) for effect in effects.values())
    block, word = _blocks(problem.records, by_member=differ)
    library, rows = components(effects, problem), np.bincount(block).astype(float)
    count = len(rows)
    table = np.array([_errors(problem, library, fit, block == k) for k in range(count)])
    picked = rng.multinomial(count, np.full(count, 1.0 / count), _SAMPLES)
    before, after, spread = (picked * rows @ table / (picked @ rows)[:, None]).T
    # The relative error of a noise variance that so many rows determine.
    free = max(problem.count - problem.X.shape[1] - len(names), 1)
    off = free / rng.chisquare(free, _SAMPLES) - 1.0
    closed = _closed(before - off, after - off)
    # With few blocks the variance of the prediction is known roughly only: the lower
    # end does without it.
    careful = _closed(before - off, after + spread - off)
    if np.isfinite(closed).mean() < 0.5:
        return None, word
    whole = rows @ table / rows.sum()
    middle = float(_closed(whole[0], whole[1]))
    middle = float(np.nanmedian(closed)) if np.isnan(middle) else middle
    low, high = np.nanquantile(careful, TAILS[0]), np.nanquantile(closed, TAILS[2])
    low, high = min(float(low), middle), max(float(high), middle)
    return Interval(median=middle, lo=low, hi=high), word


def _blocks(records: Records, *, by_member: bool) -> tuple[Int[np.ndarray, " n"], str]:
    """Return the block of each row, and the word for a block.

    Where members differ nothing predicts one without any row of it.
    """
    if by_member:
        quarter = np.clip((place_in_run(records.run) + 1.0) * 2.0, 0, 3)
        return quarter.astype(int), "a quarter of each run"
    halves, rows = half_cycles(records), len(records.run)
    if halves[-1] + 1 < _FEWEST_HALVES:
        halves = np.clip(rows // 3, 2, _MOST_STRETCHES) * np.arange(rows) // rows
        return halves, "a stretch of rows"
    whole = "unloading" in records.known
    return halves, "a half cycle" if whole else "a stretch of rows"


def _closed(before, after):
    with np.errstate(invalid="ignore", divide="ignore"):
        gap = np.where(before > 0.0, before, np.nan)
        return 1.0 - np.sqrt(np.maximum(after, 0.0) / gap)


def _errors(
    problem: LinearProblem,
    library: Components,
    fit: Fitted,
    left_out: Bool[np.ndarray, " n"],
) -> Float[np.ndarray, " 3"]:
    """Return mean squared errors on some rows of models that were fitted without them.

    In noise variances: the base model's, less the noise and less the variance of the
    prediction; the same with the effects; and the variance of that prediction.
    """
    noise, rest = fit.noise, problem.without(left_out)
    others = noise._replace(weight=np.where(left_out, 0.0, noise.weight))
    weight = noise.weight[left_out] / fit.noise_sd

    def error(parts: Sequence[Part]) -> tuple[float, float]:
        found = posterior(rest, others, parts)
        off = (problem.y - found.reading)[left_out] * weight
        sd = np.linalg.norm(found.columns[left_out] @ found.factor.T, axis=1) * weight
        return float(np.mean(off**2 - sd**2)) - 1.0, float(np.mean(sd**2))

    return np.array([error([])[0], *error(_fitted(rest, library, others))])


def _fitted(
    problem: LinearProblem, library: Components, noise: NoiseModel
) -> list[Part]:
    """Return effects at their most probable items, one after the other."""
    selection = select(problem, [noise], library, [], library.names)
    parts: list[Part] = []
    for _ in library.names:
        found = selection.evaluate(noise, join(problem, parts))
        gain = found.totals()
        gain[[part.component for part in parts]] = -np.inf
        parts.append(found.likeliest(int(np.argmax(gain))))
    return parts
