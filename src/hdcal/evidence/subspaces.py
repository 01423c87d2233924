"""Hypotheses that are subspaces: unknown structure, members, several amplitudes."""

from dataclasses import dataclass

import jax
import numpy as np
from scipy import stats

from hdcal.data.priors import Prior
from hdcal.evidence.closed_form import subspace_evidence
from hdcal.evidence.effect_curves import effect_curves, padded_records
from hdcal.evidence.inner_products import CommonTerms, subspace_products
from hdcal.evidence.kernels import principal
from hdcal.evidence.linear_rows import LinearRows
from hdcal.evidence.parameter_grid import SCALE_WEIGHTS, SCALES, make_grid
from hdcal.evidence.prepare import PreparedCase
from hdcal.physics.effect import Effect
from hdcal.physics.scatter import Scatter, scores

# Columns of a subspace; members beyond it are kept by their largest directions.
WIDTH = 24
# Steps of the scale of a subspace of unknown size, as factors of its prior sd.
_STEPS = 2.0 ** np.arange(-5.0, 3.0)

_scores = jax.jit(scores)


@dataclass(frozen=True)
class SubspaceEvidence:
    """Log evidence of each subspace.

    Attributes:
        names: of each subspace; one for each shape point of an effect.
        columns: per unit of the scale [N], shape (b, WIDTH, n).
        scale: shape (b, t).
        log_weight: log prior probability of each scale, shape (b, t).
        log_evidence: with prior weights of the scale, [correlation, b, t].
    """

    names: tuple[str, ...]
    columns: np.ndarray
    scale: np.ndarray
    log_weight: np.ndarray
    log_evidence: np.ndarray

    def of(self, name: str) -> np.ndarray:
        """Return the indices of the subspaces of one name, one for each shape."""
        return np.flatnonzero(np.asarray(self.names) == name)

    def likeliest(self, name: str) -> tuple[int, float]:
        """Return the most probable shape of a name, from 0, and its scale."""
        own = self.of(name)
        evidence = np.logaddexp.reduce(self.log_evidence[:, own], axis=0)
        shape, step = np.unravel_index(np.argmax(evidence), evidence.shape)
        return int(shape), float(self.scale[own[shape], step])

    def by_correlation(self, name: str) -> np.ndarray:
        """Return the log evidence over shapes and scales, [correlation]."""
        return mean_evidence(self.log_evidence[:, self.of(name)])


def mean_evidence(log_evidence: np.ndarray) -> np.ndarray:
    """Return the log evidence of equally probable shapes, [correlation].

    Args:
        log_evidence: with prior weights of the scales, [correlation, shape, scale].
    """
    whole = np.logaddexp.reduce(log_evidence, axis=(1, 2))
    return whole - np.log(log_evidence.shape[1])


def is_subspace(effect: type[Effect], case: PreparedCase) -> bool:
    """Return whether an effect is a subspace rather than of one amplitude."""
    if issubclass(effect, Scatter):
        return True
    return len(make_grid(effect, case.priors).amplitudes) > 1


def effect_columns(effect: type[Effect], case: PreparedCase) -> np.ndarray:
    """Return what one prior sd of each amplitude or member adds [N].

    Args:
        effect: with several amplitudes, or of members.
        case: on whose rows it acts.

    Returns:
        One subspace for each shape point, shape (s, j, n).
    """
    if issubclass(effect, Scatter):
        return _member_columns(effect, case)[None]
    grid = make_grid(effect, case.priors, kind="subspace")
    count = len(grid.amplitudes)
    values = {n: np.repeat(v, count) for n, v in grid.shapes.items()}
    for index, name in enumerate(grid.amplitudes):
        values[name] = np.tile(grid.sd * np.eye(count)[index], grid.size)
    found = effect_curves(effect, values, case.base, case.records, case.reading)
    return found.reshape(grid.size, count, -1)


def _member_columns(effect: type[Scatter], case: PreparedCase) -> np.ndarray:
    label = np.asarray(getattr(case.records, effect.members))
    one = {"sd": np.ones(1)}
    added = effect_curves(effect, one, case.base, case.records, case.reading)[0]
    padded = getattr(padded_records(case.records), effect.members)
    each = added / np.asarray(_scores(padded))[: len(label)]
    return each * (label == np.unique(label)[:, None])


def effect_scales(
    effect: type[Effect], case: PreparedCase
) -> tuple[np.ndarray, np.ndarray]:
    """Return factors on the columns of an effect and their log prior weights."""
    if not issubclass(effect, Scatter):
        padding = len(_STEPS) - len(SCALES)
        weights = np.concatenate([SCALE_WEIGHTS, np.full(padding, 1e-300)])
        return np.concatenate([SCALES, np.ones(padding)]), np.log(weights)
    return _half_normal_steps(make_grid(effect, case.priors).sd)


def large_scale(effect: type[Effect], case: PreparedCase) -> float:
    """Return the factor on the columns of an effect of a large physical size."""
    scatter = issubclass(effect, Scatter)
    return 2.0 * (make_grid(effect, case.priors).sd if scatter else 1.0)


def _half_normal_steps(sd: float) -> tuple[np.ndarray, np.ndarray]:
    edges = np.concatenate([[0.0], np.sqrt(_STEPS[1:] * _STEPS[:-1]), [np.inf]])
    mass = sum(
        weight * np.diff(stats.halfnorm.cdf(edges / scale))
        for scale, weight in zip(SCALES, SCALE_WEIGHTS, strict=True)
    )
    return sd * _STEPS, np.log(np.maximum(mass, 1e-300))


def unknown_scales(prior: Prior) -> tuple[np.ndarray, np.ndarray]:
    """Return sizes of unknown structure [N] and their log prior weights."""
    sd = float(prior.numbers[-1])
    return sd * _STEPS, np.full(len(_STEPS), -np.log(len(_STEPS)))


def evidence_of_subspaces(
    rows: LinearRows,
    common: CommonTerms,
    sigma: Prior,
    names: tuple[str, ...],
    tables: list[np.ndarray],
    scales: list[tuple[np.ndarray, np.ndarray]],
) -> SubspaceEvidence:
    """Compute the evidence of each subspace.

    Args:
        rows: the data.
        common: what all hypotheses share.
        sigma: prior of the noise sd.
        names: of the subspaces.
        tables: columns of each, shape (j, n).
        scales: factors on the columns and their log weights.
    """
    columns = np.stack([principal(np.asarray(t), WIDTH) for t in tables])
    factor = np.stack([s for s, _ in scales])
    weight = np.stack([w for _, w in scales])
    products = subspace_products(rows, columns)
    found = subspace_evidence(common, products, factor, weight, sigma)
    return SubspaceEvidence(names, columns, factor, weight, found)
