"""The size of an effect and its interval."""

import numpy as np
from scipy.special import ndtr, ndtri

from hdcal.diagnosis.verdict import Amplitude
from hdcal.evidence.case_evidence import QUANTISATION, CaseEvidence
from hdcal.evidence.design_matrix import fit_design
from hdcal.evidence.hypothesis_design import design_of
from hdcal.evidence.noise_evidence import weighted_quantiles
from hdcal.evidence.single_evidence import CellEvidence
from hdcal.physics.effect import Effect, parameters
from hdcal.physics.effects.scatter import Scatter
from hdcal.report.intervals import INTERVAL, Interval

_DRAWS = 4000


def amplitude_of(
    evidence: CaseEvidence,
    name: str,
    library: dict[str, type[Effect]],
    rng: np.random.Generator,
) -> Amplitude:
    """Return the size of an effect, given that it is the only one."""
    declared = parameters(library[name])
    field = next(f for f, about in declared.items() if about.null is not None)
    if name == QUANTISATION:
        size = Interval(*[evidence.rounding_step] * 3)
    elif name in evidence.noise:
        low, middle, high = evidence.noise[name].amplitude
        size = Interval(middle, low, high)
    elif name in evidence.single.names:
        low, middle, high = _piecewise_amplitude(evidence, name, rng)
        size = Interval(middle, low, high)
    elif issubclass(library[name], Scatter):
        size = _spread(evidence, name)
    else:
        field, size = _largest(evidence, name, library[name])
    unit = declared[field].unit
    return Amplitude(**vars(size), effect=name, parameter=field, unit=unit)


def _piecewise_amplitude(
    evidence: CaseEvidence, name: str, rng: np.random.Generator
) -> tuple[float, float, float]:
    """Return quantiles .025, .5, .975 of the amplitude of an effect in pieces."""
    index = evidence.single.names.index(name)
    draws = [_draw(part.of(index), rng) for part in evidence.single.parts]
    log_total = np.array([total for _, total in draws])
    share = np.exp(log_total - log_total.max()) / _DRAWS
    values = np.concatenate([v for v, _ in draws])
    return weighted_quantiles(values, np.repeat(share, _DRAWS))


def _draw(part: CellEvidence, rng) -> tuple[np.ndarray, float]:
    """Draw amplitudes from normals cut to their cells; return them and log evidence."""
    log_weight = part.log_evidence.ravel()
    weight = np.exp(log_weight - log_weight.max())
    chosen = rng.choice(len(weight), _DRAWS, p=weight / weight.sum())
    mean, sd = part.mean.ravel()[chosen], part.sd.ravel()[chosen]
    cell = chosen % len(part.owner)
    low, high = part.cells.low[cell], part.cells.high[cell]
    ends = ndtr((low - mean) / sd), ndtr((high - mean) / sd)
    place = np.clip(rng.uniform(*ends), 1e-300, 1.0 - 1e-16)
    values = np.clip(mean + sd * ndtri(place), low, high)
    return values, float(np.logaddexp.reduce(log_weight))


def _spread(evidence: CaseEvidence, name: str) -> Interval:
    """Return the interval of the spread of members."""
    own = evidence.subspaces.of(name)[0]
    weight = np.logaddexp.reduce(evidence.subspaces.log_evidence[:, own], axis=0)
    weight = np.exp(weight - weight.max())
    scale = np.log(evidence.subspaces.scale[own])
    low, middle, high = np.exp(weighted_quantiles(scale, weight))
    return Interval(float(middle), float(low), float(high))


def _largest(evidence: CaseEvidence, name: str, effect: type[Effect]):
    """Return the largest amplitude of several and its interval."""
    fields = [f for f, about in parameters(effect).items() if about.null is not None]
    rows = evidence.prepared.rows
    design = design_of(evidence, [name])
    fit = fit_design(rows, design, evidence.prepared.noise_sd, 0.0)
    width = rows.base.shape[1]
    count = len(fields)
    mean = fit.mean[width : width + count]
    sd = np.sqrt(np.diag(fit.covariance)[width : width + count])
    top = int(np.argmax(np.abs(mean)))
    unit = float(evidence.prepared.priors[f"{name}.{fields[top]}"].numbers[-1])
    half = float(ndtri(0.5 + 0.5 * INTERVAL)) * sd[top]
    low, high = mean[top] - half, mean[top] + half
    return fields[top], Interval(*(float(v * unit) for v in (mean[top], low, high)))
