"""The one formula: log marginal likelihood of a curve, loose columns and the noise.

y = base + o + u a + L c + noise in whitened rows. The base is projected out; c is
normal and enters by the principal axes of L; the amplitude a is normal or flat in an
interval; the noise sd is integrated by Gauss-Hermite quadrature in its logarithm.
"""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from hdcal.evidence.components import Amplitudes
from hdcal.inference.likelihood import log_interval

_LOG_2PI = float(np.log(2.0 * np.pi))
_NODES, _WEIGHTS = np.polynomial.hermite.hermgauss(5)
# Width of the quadrature over that of a normal likelihood of the log noise sd.
_WIDER = 1.3
# Points of the table of the noise prior, and its reach beyond the modes in widths.
_POINTS, _REACH = 128, 6.0
# Least precision of an amplitude that the rows do not show.
_TINY = 1e-12
_STEPS = 3


class SlopeProducts(NamedTuple):
    """Inner products with the slope u, beside the base.

    Attributes:
        eu: of error and slope, shape (m, t).
        uu: of the slope with itself, shape (m, t).
        teu: of each principal axis with the error times with the slope, (m, t, j).
        tu2: of each axis with the slope, squared, (m, t, j).
    """

    eu: Float[np.ndarray, " m t"]
    uu: Float[np.ndarray, " m t"]
    teu: Float[np.ndarray, "m t j"]
    tu2: Float[np.ndarray, "m t j"]


class Products(NamedTuple):
    """Inner products of items in whitened rows, beside the base.

    Attributes:
        ee: of the error, the readings less o, with itself, shape (m, t).
        lam: prior variance times squared length of each axis of L, (m, t, j).
        te2: of each axis with the error, squared, times the prior variance, (m, t, j).
        slope: those with the slope; None for items without one.
    """

    ee: Float[np.ndarray, " m t"]
    lam: Float[np.ndarray, "m t j"]
    te2: Float[np.ndarray, "m t j"]
    slope: SlopeProducts | None = None


class Items(NamedTuple):
    """Evaluated items, each of shape (m, t).

    Attributes:
        log_evidence: log marginal likelihood, with a prior weight where one is stated.
        mean: of the amplitude given the noise sd, before its bounds.
        sd: of the amplitude, likewise.
        noise_sd: the likeliest noise sd.
    """

    log_evidence: Float[np.ndarray, "m t"]
    mean: Float[np.ndarray, "m t"]
    sd: Float[np.ndarray, "m t"]
    noise_sd: Float[np.ndarray, "m t"]


class _Given(NamedTuple):
    """What is left at a noise variance when the loose columns are integrated out."""

    log_det: np.ndarray
    ee: np.ndarray
    eu: np.ndarray
    uu: np.ndarray


def _given(variance, products: Products) -> _Given:
    inside = variance[..., None] + products.lam
    log_det = np.sum(np.log(inside / variance[..., None]), axis=-1)
    ee = products.ee - np.sum(products.te2 / inside, axis=-1)
    if products.slope is None:
        return _Given(log_det, ee, np.zeros(()), np.zeros(()))
    eu, uu, teu, tu2 = products.slope
    eu = eu - np.sum(teu / inside, axis=-1)
    return _Given(log_det, ee, eu, uu - np.sum(tu2 / inside, axis=-1))


class _Amplitude(NamedTuple):
    """The normal factor of an amplitude in the likelihood times its prior."""

    precision: np.ndarray
    score: np.ndarray
    mean: np.ndarray


def _amplitude(given: _Given, variance, prior: Amplitudes) -> _Amplitude:
    precision = given.uu / variance + prior.precision + _TINY
    score = given.eu / variance + prior.precision * prior.mean
    return _Amplitude(precision, score, score / precision)


def log_marginal(
    count: int, products: Products, prior: Amplitudes | None, sigma: Any
) -> Items:
    """Return the log marginal likelihood of each item.

    Args:
        count: number of rows.
        products: inner products of the items.
        prior: of their amplitudes, each of shape (m,); None without a slope.
        sigma: frozen distribution of the noise sd [N].
    """
    if not products.ee.size:
        return Items(*4 * [products.ee])
    if prior is not None:
        prior = Amplitudes(*(column[:, None] for column in prior))
    variance = _likeliest_variance(count, products, prior)
    centre = 0.5 * np.log(variance)
    width = _WIDER / np.sqrt(2.0 * max(count - 4.0, 2.0))
    reach = _REACH * width
    grid = np.linspace(centre.min() - reach, centre.max() + reach, _POINTS)
    log_prior = sigma.logpdf(np.exp(grid)) + grid
    total = []
    for node, weight in zip(_NODES, _WEIGHTS, strict=True):
        log_sd = centre + np.sqrt(2.0) * width * node
        value = _log_density(count, log_sd, products, prior)
        value = value + np.interp(log_sd, grid, log_prior)
        total.append(value + np.log(weight) + node**2)
    log_evidence = np.logaddexp.reduce(total, axis=0)
    log_evidence += 0.5 * np.log(2.0 * width**2) - 0.5 * count * _LOG_2PI
    noise_sd = np.exp(centre)
    if prior is None:
        none = np.zeros_like(centre)
        return Items(log_evidence, none, none, noise_sd)
    found = _amplitude(_given(variance, products), variance, prior)
    return Items(log_evidence, found.mean, found.precision**-0.5, noise_sd)


def _likeliest_variance(count: int, products: Products, prior: Amplitudes | None):
    """Return the noise variance at which the likelihood is largest, approximately."""
    shape = np.broadcast_shapes(products.ee.shape, products.lam.shape[:-1])
    variance = np.broadcast_to(products.ee / count, shape)
    for _ in range(_STEPS):
        given = _given(variance, products)
        left = given.ee
        if prior is not None:
            size = _amplitude(given, variance, prior).mean
            size = np.clip(size, prior.low, prior.high)
            left = left - 2.0 * size * given.eu + size**2 * given.uu
        used = products.lam / (variance[..., None] + products.lam)
        free = np.maximum(count - np.sum(used, axis=-1), 1.0)
        variance = np.maximum(left, 1e-9 * products.ee) / free
    return variance


def _log_density(count: int, log_sd, products: Products, prior: Amplitudes | None):
    """Return the log density of the readings given the noise sd, less log 2π terms."""
    variance = np.exp(2.0 * log_sd)
    given = _given(variance, products)
    value = -count * log_sd - 0.5 * given.log_det - 0.5 * given.ee / variance
    if prior is None:
        return value
    precision, score, mean = _amplitude(given, variance, prior)
    root = np.sqrt(precision)
    mass = log_interval((prior.low - mean) * root, (prior.high - mean) * root)
    value = value + 0.5 * score * mean - 0.5 * prior.precision * prior.mean**2
    return value + 0.5 * (_LOG_2PI - np.log(precision)) + mass + prior.log_height
