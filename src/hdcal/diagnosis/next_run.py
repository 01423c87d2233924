"""Which run gives most information about the cause.

The information of a run about which hypothesis is true is that between the index of the
hypothesis and its Gaussian predictive [nat]. A remainder outside the library predicts
nothing and is left out.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Float

from hdcal.data.records import Records
from hdcal.diagnosis.candidate_runs import ROWS, candidate_runs
from hdcal.evidence.base_model import base_columns
from hdcal.evidence.parts import Part, coefficients, posterior
from hdcal.evidence.search import Searched
from hdcal.evidence.table import OUTSIDE, Names
from hdcal.report.item import EffectName, Item, Words

# Hypotheses that take part, draws of each, and the least that is worth a run.
_MOST, _DRAWS, _LEAST_NATS, _LEAST_SHARE = 6, 256, 0.02, 0.01


class NextRun(Item):
    """One run that a rig can do, and its information.

    Attributes:
        run: what to do, in words.
        separates: the two hypotheses that it would separate best.
        information_nats: expected information about which effect it is.
        cost: in words, such as "one ramp".
    """

    run: Words
    separates: tuple[tuple[EffectName, ...], tuple[EffectName, ...]]
    information_nats: float
    cost: str


class _Readings(NamedTuple):
    """Normal readings of runs under each hypothesis.

    Attributes:
        mean: shape (r, h, m) [N].
        covariance: shape (r, h, m, m).
    """

    mean: Float[np.ndarray, "*r h m"]
    covariance: Float[np.ndarray, "*r h m m"]


def rank_runs(
    searched: Searched,
    posterior_of: Mapping[Names, np.ndarray],
    rng: np.random.Generator,
) -> tuple[NextRun, ...]:
    """Rank runs by their information about the cause for their effort, best first.

    Args:
        searched: hypotheses of the case.
        posterior_of: probability of each, by model of the noise.
        rng: source of randomness.
    """
    share, problem = _candidates(searched, posterior_of), searched.problem
    runs = candidate_runs(problem.records, problem.reading.reference_temperature)
    if len(share) < 2 or not runs:
        return ()
    weight, names = np.array([*share.values()]), [*share]
    predicted = _predicted(searched, names, [run.records for run in runs])
    # The same random numbers for every run: they are compared with each other.
    drawn, ranked = rng.normal(size=(_DRAWS, ROWS)), []
    for run, *both in zip(runs, *predicted, strict=True):
        readings = _Readings(*both)
        one, two = _farthest(readings, weight)
        nats = _information(readings, weight, drawn)
        found = NextRun(
            run=run.words,
            separates=_differing(names[one], names[two]),
            information_nats=nats,
            cost=run.cost,
        )
        ranked.append((round(nats / run.effort, 2), found))
    ranked.sort(key=lambda item: -item[0])
    return tuple(run for _, run in ranked if run.information_nats >= _LEAST_NATS)


def _candidates(
    searched: Searched, posterior_of: Mapping[Names, np.ndarray]
) -> dict[Names, float]:
    """Return the most probable effects and pairs, and none, with their shares."""
    share: dict[Names, float] = defaultdict(float)
    for key, chance in posterior_of.items():
        names = tuple(name for name in key if name != OUTSIDE)
        if names in searched.table.parts or not key:
            share[names] += float(chance.sum())
    best = sorted(share, key=lambda names: -share[names])[:_MOST]
    best = [names for names in best if share[names] >= _LEAST_SHARE]
    if len(best) > 2 and () in best:
        # More of the same readings shows whether there is a gap, not its cause.
        best.remove(())
    total = sum(share[names] for names in best)
    return {names: share[names] / total for names in best}


def _differing(one: Names, two: Names) -> tuple[Names, Names]:
    """Return hypotheses without their common effects, unless one contains the other."""
    left, right = ({*one} - {*two}), ({*two} - {*one})
    return (tuple(sorted(left)), tuple(sorted(right))) if left and right else (one, two)


def _predicted(
    searched: Searched, keys: Sequence[Names], runs: Sequence[Records]
) -> _Readings:
    """Return the readings of each run after all that were measured."""
    problem, table = searched.problem, searched.table
    about = problem.reading, problem.priors, problem.base, problem.log_sd
    base = np.stack([base_columns(run, *about) for run in runs])
    after = jax.tree.map(
        lambda before, *new: np.stack([np.concatenate([before, n]) for n in new]),
        *(problem.records, *runs),
    )
    curves: dict[tuple, tuple[np.ndarray, np.ndarray]] = {}
    mean, covariance = [], []
    for key in keys:
        parts = table.parts.get(key, [])
        fit = posterior(problem, table.likeliest_noise(key), parts)
        columns = np.zeros((*base.shape[:2], len(fit.mean)))
        columns[..., : problem.X.shape[1]] = base
        offset = np.zeros(base.shape[:2])
        for part, place in zip(parts, coefficients(problem, parts), strict=True):
            which = part.component, part.place
            if which not in curves:
                curves[which] = _on_runs(searched, part, after)
            start, own = curves[which]
            offset += start + part.mean @ own
            wide = np.moveaxis(part.sd[:, None] * own, 1, 2)
            columns[..., place][..., : wide.shape[2]] = wide
        mean.append(offset + columns @ fit.mean)
        spread = columns @ fit.factor.T
        noise = problem.noise_sd**2 * np.eye(ROWS)
        covariance.append(spread @ np.swapaxes(spread, 1, 2) + noise)
    return _Readings(np.stack(mean, axis=1), np.stack(covariance, axis=1))


def _on_runs(
    searched: Searched, part: Part, after: Records
) -> tuple[Float[np.ndarray, "r m"], Float[np.ndarray, "r j m"]]:
    """Return offset and columns of a part on each run, history included."""
    selection, component = searched.selection, part.component
    assert part.place is not None
    if np.any(selection.atoms.owner == component):
        item = selection.atoms.pick(np.array([part.place.row]))
    else:
        item = selection.spaces[part.place.row]
    found = searched.components.on_runs(searched.problem, component, item, after)
    return found[0][:, -ROWS:], found[1][..., -ROWS:]


def _information(predicted: _Readings, share: Float[np.ndarray, " h"], normal) -> float:
    """Return the mutual information of hypothesis and readings of one run [nat]."""
    mean, factor = predicted.mean, np.linalg.cholesky(predicted.covariance)
    inverse = np.linalg.inv(factor)
    half_log_det = np.sum(np.log(np.diagonal(factor, axis1=1, axis2=2)), axis=1)
    total = 0.0
    for index in range(len(share)):
        drawn = mean[index] + normal @ factor[index].T
        off = (drawn - mean[:, None]) @ np.swapaxes(inverse, 1, 2)
        heights = -0.5 * np.einsum("hdm,hdm->hd", off, off) - half_log_det[:, None]
        joint = heights + np.log(np.maximum(share, 1e-300))[:, None]
        top = np.logaddexp.reduce(joint, axis=0)
        total += share[index] * float(np.mean(heights[index] - top))
    return max(total, 0.0)


def _farthest(predicted: _Readings, share: Float[np.ndarray, " h"]) -> tuple[int, int]:
    """Return the two hypotheses whose readings differ most."""
    one, two = np.triu_indices(len(share), 1)
    gap = predicted.mean[one] - predicted.mean[two]
    both = predicted.covariance[one] + predicted.covariance[two]
    squared = np.sum(gap * np.linalg.solve(both, gap[..., None])[..., 0], axis=1)
    best = int(np.argmax(squared * share[one] * share[two]))
    return int(one[best]), int(two[best])
