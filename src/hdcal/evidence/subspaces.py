"""Hypotheses that are subspaces: unknown structure, members, several amplitudes."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import erf

from hdcal.data.priors import Prior
from hdcal.evidence.closed_form import subspace_evidence
from hdcal.evidence.effect_curves import effect_curves, padded_records
from hdcal.evidence.inner_products import CommonTerms, subspace_products
from hdcal.evidence.kernels import principal
from hdcal.evidence.parameter_grid import (
    SCALE_WEIGHTS,
    SCALES,
    ParameterGrid,
    make_grid,
)
from hdcal.evidence.prepare import PreparedCase
from hdcal.exported import jit
from hdcal.physics.effect import Effect
from hdcal.physics.effects.scatter import Scatter, scores

# Columns of a subspace; members beyond it are kept by their largest directions.
WIDTH = 24
# Steps of the scale of a subspace of unknown size, as factors of its prior sd.
_STEPS = 2.0 ** np.arange(-5.0, 5.0)

_scores = jit(scores)


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


@dataclass(frozen=True)
class SubspaceEffect:
    """An effect with several amplitudes, or of members that differ.

    Attributes:
        columns: what one unit of each adds [N], a subspace for each shape point,
            shape (s, j, n).
        scale: values of the prior sd, in units of the columns, shape (t,).
        log_weight: log prior probability of each.
        large: a large physical size, in units of the columns.
        scatter: whether members differ.
    """

    columns: np.ndarray
    scale: np.ndarray
    log_weight: np.ndarray
    large: float
    scatter: bool


def is_subspace(effect: type[Effect], case: PreparedCase) -> bool:
    """Return whether an effect is a subspace rather than of one amplitude."""
    if issubclass(effect, Scatter):
        return True
    return len(make_grid(effect, case.priors).amplitudes) > 1


def subspace_effect(effect: type[Effect], case: PreparedCase) -> SubspaceEffect:
    """Compute the columns of an effect that is a subspace.

    Args:
        effect: with several amplitudes, or of members.
        case: on whose rows it acts.
    """
    if issubclass(effect, Scatter):
        return _member_effect(effect, case)
    grid = make_grid(effect, case.priors, kind="subspace")
    values = grid.one_amplitude_each(shown_shapes(grid, case))
    found = effect_curves(effect, values, case.base, case.records, case.reading)
    # Scales that are not needed have no weight; all subspaces have equally many.
    unused = len(_STEPS) - len(SCALES)
    return SubspaceEffect(
        found.reshape(grid.size, len(grid.amplitudes), -1),
        np.append(SCALES, np.ones(unused)),
        np.log(np.append(SCALE_WEIGHTS, np.full(unused, 1e-300))),
        large=2.0,
        scatter=False,
    )


def shown_shapes(grid: ParameterGrid, case: PreparedCase) -> dict[str, np.ndarray]:
    """Return the shape points of an effect that these records can show, by name.

    Less than a period is a bend like any other: points of periods within the stroke
    take the place of longer ones, each as often as the others but for one. Where the
    prior leaves only longer ones the period is known.

    Args:
        grid: of the effect.
        case: on whose rows it acts.

    Returns:
        As many of each as the grid has.
    """
    if not grid.effect.period:
        return grid.shapes
    stroke = np.ptp(case.records.deformation) * case.reading.radial_per_read
    shown = np.flatnonzero(grid.shapes[grid.effect.period] <= stroke)
    if not len(shown):
        return grid.shapes
    evenly = shown[np.arange(grid.size) * len(shown) // grid.size]
    return {name: value[evenly] for name, value in grid.shapes.items()}


def _member_effect(effect: type[Scatter], case: PreparedCase) -> SubspaceEffect:
    """Return what a deviation of one of each member adds, beyond that of no other."""
    label = np.asarray(getattr(case.records, effect.members))
    one = {"sd": np.ones(1)}
    added = effect_curves(effect, one, case.base, case.records, case.reading)[0]
    padded = getattr(padded_records(case.records), effect.members)
    each = added / np.asarray(_scores(padded))[: len(label)]
    columns = each * (label == np.unique(label)[:, None])
    sd = make_grid(effect, case.priors).sd
    edges = np.concatenate([[0.0], np.sqrt(_STEPS[1:] * _STEPS[:-1]), [np.inf]])
    mass = sum(
        weight * np.diff(erf(edges / (np.sqrt(2.0) * scale)))
        for scale, weight in zip(SCALES, SCALE_WEIGHTS, strict=True)
    )
    log_weight = np.log(np.maximum(mass, 1e-300))
    return SubspaceEffect(columns[None], sd * _STEPS, log_weight, 2.0 * sd, True)


def unknown_scales(prior: Prior) -> tuple[np.ndarray, np.ndarray]:
    """Return sizes of unknown structure [N] and their log prior weights."""
    sd = float(prior.numbers[-1])
    return sd * _STEPS, np.full(len(_STEPS), -np.log(len(_STEPS)))


def evidence_of_subspaces(
    case: PreparedCase,
    common: CommonTerms,
    effects: Mapping[str, SubspaceEffect],
    kernels: Mapping[str, np.ndarray],
) -> SubspaceEvidence:
    """Compute the evidence of each subspace.

    Args:
        case: the data.
        common: what all hypotheses share.
        effects: of the library, by name.
        kernels: columns of unknown structure by name, shape (j, n).
    """
    names, tables, scales = [], [], []
    for name, effect in effects.items():
        names += [name] * len(effect.columns)
        tables += list(effect.columns)
        scales += [(effect.scale, effect.log_weight)] * len(effect.columns)
    names += list(kernels)
    tables += list(kernels.values())
    scales += [unknown_scales(case.priors["gap_sd"])] * len(kernels)
    columns = np.stack([principal(np.asarray(table), WIDTH) for table in tables])
    scale, log_weight = map(np.stack, zip(*scales, strict=True))
    products = subspace_products(case.rows, columns)
    sigma = case.priors["sigma"]
    found = subspace_evidence(common, products, scale, log_weight, sigma)
    return SubspaceEvidence(tuple(names), columns, scale, log_weight, found)
