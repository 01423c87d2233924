"""Which effect causes the gap: posterior over hypotheses, and how firm it is."""

from itertools import combinations

import numpy as np
from scipy.special import ndtr, ndtri

from hdcal.diagnosis.model_posterior import NAMED, Weighed, verdict_word, weigh
from hdcal.diagnosis.verdict import Amplitude, Which
from hdcal.evidence.assessment import (
    LEAST_SEEN,
    NONE,
    QUANTISATION,
    Assessment,
    design_of,
)
from hdcal.evidence.design_matrix import fit_design
from hdcal.evidence.noise_evidence import weighted_quantiles
from hdcal.evidence.resampling import repeated_evidence
from hdcal.evidence.single_evidence import Cells, rescaled
from hdcal.evidence.whitened_rows import beside_line
from hdcal.physics.effect import Effect, parameters
from hdcal.physics.scatter import Scatter
from hdcal.report.parameters import Interval

_DRAWS = 4000
# Squared correlation, beside the base model, from which two shapes look alike.
_ALIKE = 0.8


def answer(
    found: Assessment,
    weighed: Weighed,
    detected: bool,
    library: dict[str, type[Effect]],
    rng: np.random.Generator,
) -> Which:
    """Return the verdict on the cause.

    Args:
        found: evidences.
        weighed: their posterior.
        detected: whether the gate is passed.
        library: the effects by name.
        rng: source of randomness.
    """
    word = verdict_word(weighed, detected)
    ranked = sorted(weighed.inclusion, key=lambda n: -weighed.inclusion[n])
    named = word in ("named", "ambiguous") and bool(ranked)
    effect = ranked[0] if named else None
    others = [n for n in ranked[1:] if weighed.inclusion[n] >= NAMED]
    return Which(
        verdict=word,
        effect=effect,
        second_effect=others[0] if named and others else None,
        set=weighed.smallest_set if word != "none" else (NONE,),
        probabilities=weighed.probabilities,
        inclusion=weighed.inclusion,
        log_evidence=weighed.log_evidence,
        amplitude=amplitude_of(found, effect, library, rng) if effect else None,
        not_testable=found.not_testable,
        not_excited=found.not_excited,
        inseparable=inseparable(found),
        sensitivity=sensitivity(found, effect) if effect else {},
        stability=_stability(found, effect, rng) if effect else None,
    )


def amplitude_of(
    found: Assessment,
    name: str,
    library: dict[str, type[Effect]],
    rng: np.random.Generator,
) -> Amplitude | None:
    """Return the size of an effect, given that it is the only one."""
    declared = parameters(library[name])
    field = next(f for f, about in declared.items() if about.null is not None)
    if name == QUANTISATION:
        size = Interval(found.step, found.step, found.step)
    elif name in found.noise:
        low, middle, high = found.noise[name].amplitude
        size = Interval(middle, low, high)
    elif name in found.singles.names:
        low, middle, high = line_amplitude(found, name, rng)
        size = Interval(middle, low, high)
    elif issubclass(library[name], Scatter):
        size = _spread(found, name)
    else:
        field, size = _largest(found, name, library[name])
    return Amplitude(name, field, declared[field].unit, size)


def line_amplitude(
    found: Assessment, name: str, rng: np.random.Generator
) -> tuple[float, float, float]:
    """Return quantiles .05, .5, .95 of the amplitude of a single-line effect."""
    index = found.singles.names.index(name)
    draws = [_draw(cells, index, rng) for cells in found.singles.cells]
    log_total = np.array([total for _, total in draws])
    share = np.exp(log_total - log_total.max()) / _DRAWS
    values = np.concatenate([v for v, _ in draws])
    return weighted_quantiles(values, np.repeat(share, _DRAWS))


def _draw(cells: Cells, index: int, rng) -> tuple[np.ndarray, float]:
    """Draw amplitudes from normals cut to their cells; return them and log evidence."""
    own = np.flatnonzero(cells.owner == index)
    log_weight = cells.log_evidence[:, own].ravel()
    weight = np.exp(log_weight - log_weight.max())
    chosen = rng.choice(len(weight), _DRAWS, p=weight / weight.sum())
    row, entry = np.unravel_index(chosen, (len(cells.log_evidence), len(own)))
    mean, sd = cells.mean[row, own[entry]], cells.sd[row, own[entry]]
    low, high = (
        np.asarray(edge)[own[entry]] for edge in (cells.entries.low, cells.entries.high)
    )
    ends = ndtr((low - mean) / sd), ndtr((high - mean) / sd)
    place = np.clip(rng.uniform(*ends), 1e-300, 1.0 - 1e-16)
    values = np.clip(mean + sd * ndtri(place), low, high)
    return values, float(np.logaddexp.reduce(log_weight))


def _spread(found: Assessment, name: str) -> Interval:
    own = found.subspaces.of(name)[0]
    weight = np.logaddexp.reduce(found.subspaces.log_evidence[:, own], axis=0)
    weight = np.exp(weight - weight.max())
    place = (np.cumsum(weight) - 0.5 * weight) / weight.sum()
    scale = np.log(found.subspaces.scale[own])
    low, middle, high = np.exp(np.interp((0.05, 0.5, 0.95), place, scale))
    return Interval(float(middle), float(low), float(high))


def _largest(found: Assessment, name: str, effect: type[Effect]):
    """Return the largest amplitude of several and its interval."""
    fields = [f for f, about in parameters(effect).items() if about.null is not None]
    rows = found.setting.rows
    design = design_of(found, [name])
    fit = fit_design(rows, design, found.setting.noise_sd, 0.0)
    width = rows.base.shape[1]
    count = len(fields)
    mean = fit.mean[width : width + count]
    sd = np.sqrt(np.diag(fit.covariance)[width : width + count])
    top = int(np.argmax(np.abs(mean)))
    unit = float(found.setting.priors[f"{name}.{fields[top]}"].numbers[-1])
    low, high = mean[top] - 1.645 * sd[top], mean[top] + 1.645 * sd[top]
    return fields[top], Interval(*(float(v * unit) for v in (mean[top], low, high)))


def inseparable(found: Assessment) -> tuple[tuple[str, str], ...]:
    """Return pairs of effects that this loading program can never tell apart.

    In the best case most of the smaller one is shared by the other, and what is not
    has less than `LEAST_SEEN` squared noise sds.
    """
    rows, noise = found.setting.rows, found.setting.noise_sd
    left = {
        each.name: np.asarray(beside_line(rows, each.reach)) * rows.weight
        for each in found.lines
        if each.name in found.table
    }
    pairs = []
    for one, two in combinations(left, 2):
        a, b = left[one], left[two]
        size_a, size_b = np.sum(a**2, axis=1), np.sum(b**2, axis=1)
        share = (a @ b.T) ** 2 / np.maximum(size_a[:, None] * size_b, 1e-300)
        apart = np.minimum(size_a[:, None], size_b) * (1.0 - share)
        alike = np.min(share) > _ALIKE
        if alike and np.max(apart) < LEAST_SEEN * noise**2:
            pairs.append((one, two))
    return tuple(pairs)


def sensitivity(found: Assessment, effect: str) -> dict[str, float]:
    """Return the top effect's inclusion with amplitude priors ⅓ and 3 times as wide.

    Evidences of single lines are computed anew; pairs move with their members.
    """
    result = {}
    for word, factor in (("narrower_x1/3", 1.0 / 3.0), ("wider_x3", 3.0)):
        moved = rescaled(found.singles, found.lines, found.setting.priors, factor)
        table = {
            name: value + sum(moved.get(part, 0.0) for part in name.split("+"))
            for name, value in found.table.items()
        }
        result[word] = float(weigh(table).inclusion[effect])
    return result


def _stability(found: Assessment, effect: str, rng) -> float | None:
    """Return the share of block-bootstrap samples in which the same effect wins."""
    if effect not in found.singles.names:
        return None
    evidence = repeated_evidence(found, rng)
    names = [NONE, *found.singles.names]
    best = np.argmax(evidence, axis=1)
    return float(np.mean([names[i] == effect for i in best]))
