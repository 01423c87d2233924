"""Which run would tell most about the cause: expected information in nats.

The information of a run about which hypothesis is true is that between the index
of the hypothesis and its Gaussian predictive. "Unknown" predicts nothing and is
left out.
"""

from itertools import combinations

import jax
import numpy as np

from hdcal.diagnosis.candidate_runs import ROWS, CandidateRun, candidate_runs
from hdcal.diagnosis.model_posterior import ModelPosterior
from hdcal.diagnosis.verdict import NextRun
from hdcal.evidence.case_evidence import NONE, UNKNOWN, CaseEvidence
from hdcal.evidence.design_matrix import DesignMatrix, fit_design, join_designs
from hdcal.evidence.effect_curves import effect_curves
from hdcal.evidence.hypothesis_design import design_of
from hdcal.evidence.parameter_grid import make_grid
from hdcal.evidence.prepare import PreparedCase
from hdcal.evidence.subspaces import shown_shapes
from hdcal.physics.effect import Effect

# Hypotheses that take part, draws of each, and the least that is worth a run.
_MOST, _DRAWS, _LEAST_NATS, _LEAST_SHARE = 6, 256, 0.02, 0.01
_NOTHING = join_designs([], ROWS)
_TOO_FEW = (
    "fewer than two hypotheses about the mean force are left to tell apart; a cause "
    "outside the library predicts nothing"
)
_TELLS_LITTLE = "no run that a rig of this kind can do would tell more"


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
    names = list(share)
    runs = candidate_runs(prepared.records, prepared.reading.reference_temperature)
    tables = {name: _designs(evidence, name, runs, library) for name in names}
    weight = np.array(list(share.values()))
    # The same random numbers for every run: they are compared with each other.
    drawn = rng.normal(size=(_DRAWS, ROWS))
    ranked = []
    for index, run in enumerate(runs):
        base = prepared.base_columns(run.records)
        predicted = [_predict(evidence, n, base, tables[n][index]) for n in names]
        nats, apart = _information(predicted, weight, drawn)
        pair = max(apart, key=lambda p: apart[p])
        separates = tuple(names[i] for i in pair)
        worth = round(nats / run.effort, 2)
        ranked.append((worth, NextRun(run.words, separates, nats, run.cost)))
    ranked.sort(key=lambda item: -item[0])
    chosen = tuple(run for _, run in ranked if run.information_nats >= _LEAST_NATS)
    return chosen, "" if chosen else _TELLS_LITTLE


def _candidates(evidence: CaseEvidence, posterior: ModelPosterior) -> dict[str, float]:
    """Return the likeliest effects, and none, with their shares.

    What stands beside an effect on the noise, or a remainder, tells a run nothing.
    """
    allowed = NONE, *evidence.single.names, *evidence.subspace_effects
    share = dict.fromkeys(allowed, 0.0)
    for name, chance in posterior.probabilities.items():
        alone = {*name.split("+")} - {*evidence.on_noise} or {NONE}
        mean = "+".join(alone - {UNKNOWN})
        if mean in share:
            share[mean] += chance
    best = sorted(share, key=lambda name: -share[name])[:_MOST]
    best = [n for n in best if share[n] >= _LEAST_SHARE]
    if len(best) > 2 and NONE in best:
        # That there is a gap is settled by more of the same; which one is not.
        best.remove(NONE)
    total = sum(share[n] for n in best)
    return {n: share[n] / total for n in best} if total > 0.0 else {}


def _designs(
    evidence: CaseEvidence,
    name: str,
    runs: list[CandidateRun],
    library: dict[str, type[Effect]],
) -> list[DesignMatrix]:
    """Return the design of an effect on the rows of each run, history included."""
    if name == NONE:
        return [_NOTHING] * len(runs)
    own = design_of(evidence, [name])
    design = _piece_on_run if name in evidence.single.names else _subspace_on_run
    return [design(evidence, library[name], own, run) for run in runs]


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
    evidence: CaseEvidence, effect, own: DesignMatrix, run: CandidateRun
) -> DesignMatrix:
    """Return an effect about its fitted amplitude as linear."""
    prepared = evidence.prepared
    fit = fit_design(prepared.rows, own, prepared.noise_sd, 0.0)
    centre, spread = fit.mean[-1], np.sqrt(fit.covariance[-1, -1])
    grid = make_grid(effect, prepared.priors)
    low, high = centre - spread, centre + spread
    if grid.one_sided:
        low, high = max(low, 0.02 * abs(high)), max(high, 1e-9)
    shapes = {k.split(".")[1]: np.full(2, v) for k, v in own.values.items()}
    values = {**shapes, grid.amplitudes[0]: np.array([low, high])}
    table = _curves_on_run(prepared, effect, values, run)
    slope = (table[1] - table[0]) / (high - low)
    offset = table[0] - slope * low
    return DesignMatrix(offset, slope[None], own.mean, own.sd, own.values)


def _subspace_on_run(
    evidence: CaseEvidence, effect, own: DesignMatrix, run: CandidateRun
) -> DesignMatrix:
    """Return a subspace, which says something only where amplitudes are parameters."""
    prepared = evidence.prepared
    grid = make_grid(effect, prepared.priors, kind="subspace")
    if len(grid.amplitudes) != len(own.columns):
        # Members of a new run or gear are new: their scatter adds to the noise.
        return _NOTHING
    shape, _ = evidence.subspaces.likeliest(effect.name)
    shapes = shown_shapes(grid, prepared)
    values = grid.one_amplitude_each({n: v[[shape]] for n, v in shapes.items()})
    table = _curves_on_run(prepared, effect, values, run)
    return DesignMatrix(np.zeros(ROWS), table, own.mean, own.sd, {})


def _predict(evidence: CaseEvidence, name: str, base: np.ndarray, new: DesignMatrix):
    """Return mean and covariance of a run's readings [N] under one hypothesis."""
    prepared = evidence.prepared
    own = design_of(evidence, [] if name == NONE else [name])
    if len(new.columns) != len(own.columns):
        own = design_of(evidence, [])
    fit = fit_design(prepared.rows, own, prepared.noise_sd, 0.0)
    columns = np.column_stack([base, new.columns.T])
    mean = new.offset + columns @ fit.mean
    noise = prepared.noise_sd**2 * np.eye(ROWS)
    return mean, columns @ fit.covariance @ columns.T + noise


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
