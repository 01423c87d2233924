"""Which run would tell most about the cause: expected information in nats.

The information of a run about which hypothesis is true is that between the index
of the hypothesis and its Gaussian predictive. "Unknown" predicts nothing and is
left out.
"""

from itertools import combinations

import jax
import numpy as np

from hdcal.data.records import Records
from hdcal.diagnosis.candidate_runs import ROWS, Proposal, proposals
from hdcal.diagnosis.model_posterior import Weighed
from hdcal.diagnosis.verdict import NextRun
from hdcal.evidence.amplitude_grids import make_grid
from hdcal.evidence.assessment import NONE, Assessment, design_of
from hdcal.evidence.design_matrix import Design, fit_design, join_designs
from hdcal.evidence.effect_curves import curves
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
    found: Assessment,
    weighed: Weighed,
    library: dict[str, type[Effect]],
    rng: np.random.Generator,
) -> tuple[tuple[NextRun, ...], str]:
    """Rank runs by what they would tell about the cause for their effort, best first.

    Args:
        found: evidences.
        weighed: their posterior.
        library: the effects by name.
        rng: source of randomness.

    Returns:
        The runs that are worth it, and why there are none.
    """
    share = _candidates(found, weighed)
    if len(share) < 2:
        return (), _TOO_FEW
    setting = found.setting
    names = list(share)
    runs = proposals(setting.records, setting.reading.reference_temperature)
    tables = {name: _lines(found, name, runs, library) for name in names}
    weight = np.array(list(share.values()))
    # The same random numbers for every run: they are compared with each other.
    drawn = rng.normal(size=(_DRAWS, ROWS))
    ranked = []
    for index, proposal in enumerate(runs):
        base = setting.base_columns(proposal.records)
        predicted = [_predict(found, name, base, tables[name][index]) for name in names]
        nats, apart = _information(predicted, weight, drawn)
        pair = max(apart, key=lambda p: apart[p])
        separates = tuple(names[i] for i in pair)
        run = NextRun(proposal.words, separates, nats, proposal.cost)
        ranked.append((round(nats / proposal.effort, 2), run))
    ranked.sort(key=lambda run: -run[0])
    worth = tuple(run for _, run in ranked if run.information_nats >= _LEAST_NATS)
    return worth, "" if worth else _TELLS_LITTLE


def _candidates(found: Assessment, weighed: Weighed) -> dict[str, float]:
    """Return the likeliest single effects, and none, with their shares."""
    allowed = {NONE, *found.singles.names, *found.wide}
    share = {n: p for n, p in weighed.probabilities.items() if n in allowed}
    best = sorted(share, key=lambda name: -share[name])[:_MOST]
    best = [n for n in best if share[n] >= _LEAST_SHARE]
    if len(best) > 2 and NONE in best:
        # That there is a gap is settled by more of the same; which one is not.
        best.remove(NONE)
    total = sum(share[n] for n in best)
    return {n: share[n] / total for n in best} if total > 0.0 else {}


def _joined(old: Records, new: Records) -> Records:
    return jax.tree.map(lambda a, b: np.concatenate([a, b]), old, new)


def _lines(
    found: Assessment,
    name: str,
    runs: list[Proposal],
    library: dict[str, type[Effect]],
) -> list[Design]:
    """Return the design of an effect on the rows of each proposal, history included."""
    if name == NONE:
        return [_NOTHING] * len(runs)
    own = design_of(found, [name])
    extend = _one_line if name in found.singles.names else _subspace
    return [extend(found, library[name], own, proposal) for proposal in runs]


def _one_line(found, effect, own: Design, proposal: Proposal) -> Design:
    setting = found.setting
    fit = fit_design(setting.rows, own, setting.noise_sd, 0.0)
    centre, spread = fit.mean[-1], np.sqrt(fit.covariance[-1, -1])
    grid = make_grid(effect, setting.priors)
    low, high = centre - spread, centre + spread
    if grid.one_sided:
        low, high = max(low, 0.02 * abs(high)), max(high, 1e-9)
    shapes = {k.split(".")[1]: np.full(2, v) for k, v in own.values.items()}
    values = {**shapes, grid.amplitudes[0]: np.array([low, high])}
    joined = _joined(setting.records, proposal.records)
    table = curves(effect, values, setting.base, joined, setting.reading)[:, -ROWS:]
    slope = (table[1] - table[0]) / (high - low)
    return Design(table[0] - slope * low, slope[None], own.mean, own.sd, own.values)


def _subspace(found, effect, own: Design, proposal: Proposal) -> Design:
    """A subspace is carried on only where its amplitudes are parameters."""
    setting = found.setting
    grid = make_grid(effect, setting.priors, kind="subspace")
    count = len(own.columns)
    if len(grid.amplitudes) != count:
        # Members of a new run or gear are new: their scatter adds to the noise.
        return _NOTHING
    shape, _ = found.subspaces.likeliest(effect.name)
    values = {n: np.full(count, v[shape]) for n, v in grid.shapes.items()}
    for index, field in enumerate(grid.amplitudes):
        values[field] = grid.sd * np.eye(count)[index]
    joined = _joined(setting.records, proposal.records)
    table = curves(effect, values, setting.base, joined, setting.reading)[:, -ROWS:]
    return Design(np.zeros(ROWS), table, own.mean, own.sd, {})


def _predict(found: Assessment, name: str, base: np.ndarray, new: Design):
    """Return mean and covariance of a run's readings [N] under one hypothesis."""
    setting = found.setting
    own = design_of(found, [] if name == NONE else [name])
    if len(new.columns) != len(own.columns):
        own = design_of(found, [])
    fit = fit_design(setting.rows, own, setting.noise_sd, 0.0)
    columns = np.column_stack([base, new.columns.T])
    mean = new.offset + columns @ fit.mean
    noise = setting.noise_sd**2 * np.eye(ROWS)
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
        weighed = heights + np.log(np.maximum(share, 1e-300))[:, None]
        top = np.logaddexp.reduce(weighed, axis=0)
        total += share[index] * float(np.mean(heights[index] - top))
    apart = {}
    for i, j in combinations(range(len(predicted)), 2):
        gap = predicted[i][0] - predicted[j][0]
        both = predicted[i][1] + predicted[j][1]
        apart[i, j] = float(gap @ np.linalg.solve(both, gap)) * share[i] * share[j]
    return max(total, 0.0), apart
