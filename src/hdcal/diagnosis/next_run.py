"""Which run would tell most about the cause: expected information in nats.

The information of a run about which hypothesis is true is that between the index
of the hypothesis and its Gaussian predictive. "Unknown" predicts nothing and is
left out.
"""

from dataclasses import dataclass, replace
from itertools import combinations

import jax
import numpy as np

from hdcal.diagnosis.candidate_runs import ROWS, CandidateRun, candidate_runs
from hdcal.diagnosis.model_posterior import ModelPosterior
from hdcal.diagnosis.verdict import NextRun
from hdcal.evidence.case_evidence import NONE, UNKNOWN, CaseEvidence
from hdcal.evidence.design_matrix import (
    DesignFit,
    DesignMatrix,
    fit_design,
    join_designs,
)
from hdcal.evidence.effect_curves import effect_curves
from hdcal.evidence.hypothesis_design import design_of
from hdcal.evidence.parameter_grid import make_grid
from hdcal.evidence.prepare import PreparedCase
from hdcal.evidence.subspaces import shown_shapes
from hdcal.physics.effect import Effect

# Hypotheses that take part, draws of each, and the least that is worth a run.
_MOST, _DRAWS, _LEAST_NATS, _LEAST_SHARE = 6, 256, 0.02, 0.01
_TOO_FEW = (
    "fewer than two hypotheses about the mean reading are left to tell apart; a cause "
    "outside the library predicts nothing"
)
_TELLS_LITTLE = "no run that a rig of this kind can do would tell more"


@dataclass(frozen=True)
class _Hypothesis:
    """Effects on the mean that may act together, fitted to the readings.

    Attributes:
        name: effects joined with +, or none.
        fit: of base and effects.
        runs: what the effects add in each run, the columns as those of the fit.
    """

    name: str
    fit: DesignFit
    runs: list[DesignMatrix]

    def predict(
        self, run: int, base: np.ndarray, noise_sd: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and covariance of a run's readings [N]."""
        new = self.runs[run]
        columns = np.column_stack([base, new.columns.T])
        noise = noise_sd**2 * np.eye(ROWS)
        covariance = columns @ self.fit.covariance @ columns.T + noise
        return new.offset + columns @ self.fit.mean, covariance


def rank_runs(
    evidence: CaseEvidence,
    posterior: ModelPosterior,
    library: dict[str, type[Effect]],
    rng: np.random.Generator,
) -> tuple[tuple[NextRun, ...], str]:
    """Rank runs by what they would tell about the cause for their effort, best first.

    Returns:
        The runs that are worth it, and why there are none.
    """
    share = _candidates(evidence, posterior)
    if len(share) < 2:
        return (), _TOO_FEW
    prepared = evidence.prepared
    runs = candidate_runs(prepared.records, prepared.reading.reference_temperature)
    tried = [_fitted(evidence, name, runs, library) for name in share]
    weight = np.array(list(share.values()))
    # The same random numbers for every run: they are compared with each other.
    drawn = rng.normal(size=(_DRAWS, ROWS))
    ranked = []
    for index, run in enumerate(runs):
        base = prepared.base_columns(run.records)
        predicted = [each.predict(index, base, prepared.noise_sd) for each in tried]
        nats, apart = _information(predicted, weight, drawn)
        one, two = max(apart, key=lambda p: apart[p])
        separates = _differing(tried[one].name, tried[two].name)
        worth = round(nats / run.effort, 2)
        ranked.append((worth, NextRun(run.words, separates, nats, run.cost)))
    ranked.sort(key=lambda item: -item[0])
    chosen = tuple(run for _, run in ranked if run.information_nats >= _LEAST_NATS)
    return chosen, "" if chosen else _TELLS_LITTLE


def _candidates(evidence: CaseEvidence, posterior: ModelPosterior) -> dict[str, float]:
    """Return the likeliest effects and pairs, and none, with their shares.

    What stands beside an effect on the noise, or a remainder, tells a run nothing.
    """
    allowed = {NONE, *evidence.single.names, *evidence.subspace_effects}
    share = dict.fromkeys(sorted(allowed), 0.0)
    for name, chance in posterior.probabilities.items():
        alone = {*name.split("+")} - {*evidence.on_noise} or {NONE}
        mean = alone - {UNKNOWN}
        if mean and mean <= allowed:
            joined = "+".join(sorted(mean))
            share[joined] = share.get(joined, 0.0) + chance
    best = sorted(share, key=lambda name: -share[name])[:_MOST]
    best = [n for n in best if share[n] >= _LEAST_SHARE]
    if len(best) > 2 and NONE in best:
        # That there is a gap is settled by more of the same; which one is not.
        best.remove(NONE)
    total = sum(share[n] for n in best)
    return {n: share[n] / total for n in best} if total > 0.0 else {}


def _differing(one: str, two: str) -> tuple[str, str]:
    """Return hypotheses without what they share, unless one lies in the other."""
    first, second = one.split("+"), two.split("+")
    left = [n for n in first if n not in second]
    right = [n for n in second if n not in first]
    return ("+".join(left), "+".join(right)) if left and right else (one, two)


def _fitted(
    evidence: CaseEvidence,
    name: str,
    runs: list[CandidateRun],
    library: dict[str, type[Effect]],
) -> _Hypothesis:
    """Return a hypothesis and what it adds to each run, history included."""
    prepared = evidence.prepared
    parts = [] if name == NONE else name.split("+")
    own = [design_of(evidence, [part]) for part in parts]
    joined = join_designs(own, len(prepared.rows.reading))
    fit = fit_design(prepared.rows, joined, prepared.noise_sd, 0.0)
    spread = np.sqrt(np.diag(fit.covariance))
    at = prepared.rows.base.shape[1]
    designs: list[list[DesignMatrix]] = [[] for _ in runs]
    for part, design in zip(parts, own, strict=True):
        for index, run in enumerate(runs):
            if part in evidence.single.names:
                size = float(fit.mean[at]), float(spread[at])
                new = _piece_on_run(prepared, library[part], design, size, run)
            else:
                new = _subspace_on_run(evidence, library[part], design, run)
            designs[index].append(new)
        at += len(design.columns)
    return _Hypothesis(name, fit, [join_designs(each, ROWS) for each in designs])


def _curves_on_run(
    prepared: PreparedCase, effect, values, run: CandidateRun
) -> np.ndarray:
    """Return what an effect adds in a run after all that were taken [N]."""
    joined = jax.tree.map(
        lambda old, new: np.concatenate([old, new]), prepared.records, run.records
    )
    table = effect_curves(effect, values, prepared.base, joined, prepared.reading)
    return table[:, -ROWS:]


def _piece_on_run(
    prepared: PreparedCase,
    effect,
    own: DesignMatrix,
    size: tuple[float, float],
    run: CandidateRun,
) -> DesignMatrix:
    """Return an effect about its fitted amplitude, of mean and sd, as linear."""
    centre, spread = size
    grid = make_grid(effect, prepared.priors)
    low, high = centre - spread, centre + spread
    if grid.one_sided:
        low, high = max(low, 0.02 * abs(high)), max(high, 1e-9)
    shapes = {k.split(".")[1]: np.full(2, v) for k, v in own.values.items()}
    values = {**shapes, grid.amplitudes[0]: np.array([low, high])}
    table = _curves_on_run(prepared, effect, values, run)
    slope = (table[1] - table[0]) / (high - low)
    offset = table[0] - slope * low
    return replace(own, offset=offset, columns=slope[None])


def _subspace_on_run(
    evidence: CaseEvidence, effect, own: DesignMatrix, run: CandidateRun
) -> DesignMatrix:
    """Return a subspace, which says something only where amplitudes are parameters."""
    prepared = evidence.prepared
    grid = make_grid(effect, prepared.priors, kind="subspace")
    if len(grid.amplitudes) != len(own.columns):
        # Members of a new run or gear are new: nothing is known of them.
        table = np.zeros((len(own.columns), ROWS))
    else:
        shape, _ = evidence.subspaces.likeliest(effect.name)
        shapes = shown_shapes(grid, prepared)
        values = grid.one_amplitude_each({n: v[[shape]] for n, v in shapes.items()})
        table = _curves_on_run(prepared, effect, values, run)
    return replace(own, offset=np.zeros(ROWS), columns=table)


def _information(predicted, share, normal) -> tuple[float, dict]:
    """Return the mutual information [nat] and how far each pair lies apart."""
    factors = [np.linalg.cholesky(cov) for _, cov in predicted]
    half_log_det = [float(np.sum(np.log(np.diag(f)))) for f in factors]
    total = 0.0
    for index, (mean, _) in enumerate(predicted):
        drawn = mean + normal @ factors[index].T
        heights = np.stack(
            [
                -0.5 * np.sum(np.linalg.solve(f, (drawn - m).T) ** 2, axis=0) - h
                for (m, _), f, h in zip(predicted, factors, half_log_det, strict=True)
            ]
        )
        posterior = heights + np.log(np.maximum(share, 1e-300))[:, None]
        top = np.logaddexp.reduce(posterior, axis=0)
        total += share[index] * float(np.mean(heights[index] - top))
    apart = {}
    for i, j in combinations(range(len(predicted)), 2):
        gap = predicted[i][0] - predicted[j][0]
        both = predicted[i][1] + predicted[j][1]
        apart[i, j] = float(gap @ np.linalg.solve(both, gap)) * share[i] * share[j]
    return max(total, 0.0), apart
