"""Which run would tell most about the cause: expected information in nats.

The information of a run about which hypothesis is true is that between the index of the
hypothesis and its Gaussian predictive. What is outside the library predicts nothing and
is left out.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import jax
import numpy as np
from jaxtyping import Float

from hdcal.data.records import Records
from hdcal.diagnosis.candidate_runs import ROWS, CandidateRun, candidate_runs
from hdcal.evidence.components import atom_on_rows, space_on_rows
from hdcal.evidence.linear_problem import base_columns
from hdcal.evidence.parts import Part, coefficients, posterior
from hdcal.evidence.search import Searched
from hdcal.evidence.table import OUTSIDE, Names
from hdcal.report.item import EffectName, Item, Words

# Hypotheses that take part, draws of each, and the least that is worth a run.
_MOST, _DRAWS, _LEAST_NATS, _LEAST_SHARE = 6, 256, 0.02, 0.01


class NextRun(Item):
    """One run that a rig can do and what it would tell.

    Attributes:
        run: what to do, in words.
        separates: the two hypotheses that it would tell apart best.
        information_nats: expected information about which effect it is.
        cost: in words, such as "one ramp".
    """

    run: Words
    separates: tuple[tuple[EffectName, ...], tuple[EffectName, ...]]
    information_nats: float
    cost: str


@dataclass(frozen=True)
class _Predicted:
    """Readings of a run under one hypothesis: normal, (m,) and (m, m) [N]."""

    mean: Float[np.ndarray, " m"]
    covariance: Float[np.ndarray, "m m"]


def rank_runs(
    searched: Searched,
    posterior_of: Mapping[Names, np.ndarray],
    rng: np.random.Generator,
) -> tuple[NextRun, ...]:
    """Rank runs by what they would tell about the cause for their effort, best first.

    Args:
        searched: hypotheses of the case.
        posterior_of: probability of each, by model of the noise.
        rng: source of randomness.
    """
    share = _candidates(searched, posterior_of)
    if len(share) < 2:
        return ()
    problem = searched.problem
    runs = candidate_runs(problem.records, problem.reading.reference_temperature)
    weight, names = np.array([*share.values()]), [*share]
    # The same random numbers for every run: they are compared with each other.
    drawn, ranked = rng.normal(size=(_DRAWS, ROWS)), []
    for run in runs:
        predicted = [_predicted(searched, key, run) for key in names]
        nats, apart = _information(predicted, weight, drawn)
        one, two = max(apart, key=lambda pair: apart[pair])
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
    """Return the likeliest effects and pairs, and none, with their shares.

    What stands beside them outside the library tells a run nothing.
    """
    share: dict[Names, float] = defaultdict(float)
    for key, chance in posterior_of.items():
        names = tuple(name for name in key if name != OUTSIDE)
        if names in searched.table.parts or not key:
            share[names] += float(chance.sum())
    best = sorted(share, key=lambda names: -share[names])[:_MOST]
    best = [names for names in best if share[names] >= _LEAST_SHARE]
    if len(best) > 2 and () in best:
        # That there is a gap is settled by more of the same; which one is not.
        best.remove(())
    total = sum(share[names] for names in best)
    return {names: share[names] / total for names in best}


def _differing(one: Names, two: Names) -> tuple[Names, Names]:
    """Return hypotheses without what they share, unless one lies in the other."""
    left, right = ({*one} - {*two}), ({*two} - {*one})
    return (tuple(sorted(left)), tuple(sorted(right))) if left and right else (one, two)


def _predicted(searched: Searched, key: Names, run: CandidateRun) -> _Predicted:
    """Return the readings of a run after all that were taken."""
    problem, table = searched.problem, searched.table
    parts = table.parts.get(key, [])
    fit = posterior(problem, table.likeliest_noise(key), parts)
    new = run.records
    width = problem.X.shape[1]
    columns = np.zeros((ROWS, len(fit.mean)))
    columns[:, :width] = base_columns(
        new, problem.reading, problem.priors, problem.base, problem.log_sd
    )
    offset = np.zeros(ROWS)
    for part, place in zip(parts, coefficients(problem, parts), strict=True):
        start, own = _on_run(searched, part, new)
        offset += start + part.mean @ own
        columns[:, place][:, : len(own)] = (part.sd[:, None] * own).T
    spread = columns @ fit.factor.T
    covariance = spread @ spread.T + problem.noise_sd**2 * np.eye(ROWS)
    return _Predicted(offset + columns @ fit.mean, covariance)


def _on_run(
    searched: Searched, part: Part, new: Records
) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, "j m"]]:
    """Return offset and columns of a part on a run, history included."""
    selection, problem = searched.selection, searched.problem
    effect = searched.predicting.effects[selection.names[part.component]]
    joined = jax.tree.map(
        lambda old, more: np.concatenate([old, more]), problem.records, new
    )
    after = replace(problem, records=joined)
    if np.any(selection.atoms.owner == part.component):
        atom = selection.atoms.pick(part.place.row)
        offset, slope = atom_on_rows(effect, after, atom)
        return offset[-ROWS:], slope[None, -ROWS:]
    shape = selection.spaces[part.place.row].shape
    if shape < 0:
        # Members of a new run or gear are new: nothing is known of them.
        return np.zeros(ROWS), np.zeros((len(part.columns), ROWS))
    return np.zeros(ROWS), space_on_rows(effect, after, shape)[:, -ROWS:]


def _information(
    predicted: Sequence[_Predicted], share: Float[np.ndarray, " h"], normal
) -> tuple[float, dict[tuple[int, int], float]]:
    """Return the mutual information [nat] and how far each pair lies apart."""
    factors = [np.linalg.cholesky(one.covariance) for one in predicted]
    half_log_det = [float(np.sum(np.log(np.diag(f)))) for f in factors]
    total = 0.0
    for index, one in enumerate(predicted):
        drawn = one.mean + normal @ factors[index].T
        heights = np.stack(
            [
                -0.5 * np.sum(np.linalg.solve(f, (drawn - each.mean).T) ** 2, axis=0)
                - h
                for each, f, h in zip(predicted, factors, half_log_det, strict=True)
            ]
        )
        joint = heights + np.log(np.maximum(share, 1e-300))[:, None]
        top = np.logaddexp.reduce(joint, axis=0)
        total += share[index] * float(np.mean(heights[index] - top))
    apart = {}
    for i, j in combinations(range(len(predicted)), 2):
        gap = predicted[i].mean - predicted[j].mean
        both = predicted[i].covariance + predicted[j].covariance
        apart[i, j] = float(gap @ np.linalg.solve(both, gap)) * share[i] * share[j]
    return max(total, 0.0), apart
