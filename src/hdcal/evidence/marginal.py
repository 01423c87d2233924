"""The one formula: log marginal likelihood of a curve, loose columns and the noise.

y = base + o + u a + L c + noise in whitened rows. The base is projected out; c is
normal and enters by the principal axes of L; the amplitude a is normal or flat in an
interval; the noise sd is integrated by Gauss-Hermite quadrature in its logarithm.
"""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from hdcal.evidence.items import Amplitudes
from hdcal.inference.force_model.likelihood import log_interval

_LOG_2PI = float(np.log(2.0 * np.pi))
_NODES, _WEIGHTS = np.polynomial.hermite.hermgauss(5)
# Width of the quadrature over that of a normal likelihood of the log noise sd.
_WIDER = 1.3
# Points of the table of the noise prior, and its reach beyond the modes in widths.
_POINTS, _REACH = 128, 6.0
# Least precision of an amplitude that the rows do not show.
_TINY = 1e-12
_STEPS = 3


class Products(NamedTuple):
    """Inner products of items in whitened rows, less what the base explains.

    Of the error e, the readings less o, the slope u and each principal axis t of L.
    `square` is the squared length of each axis.
    """

    ee: Float[np.ndarray, " m"]
    eu: Float[np.ndarray, " m"]
    uu: Float[np.ndarray, " m"]
    te: Float[np.ndarray, "m j"]
    tu: Float[np.ndarray, "m j"]
    square: Float[np.ndarray, "m j"]


class Marginal(NamedTuple):
    """Log evidence of items, and their amplitudes given the noise sd.

    The amplitudes are before any bounds; the evidence has a prior weight where one is
    stated.
    """

    log_evidence: Float[np.ndarray, "m t"]
    mean: Float[np.ndarray, "m t"]
    sd: Float[np.ndarray, "m t"]


class _Given(NamedTuple):
    """Products at a noise variance, and the rows that the loose columns use up."""

    log_det: np.ndarray
    ee: np.ndarray
    eu: np.ndarray
    uu: np.ndarray
    used: np.ndarray


class _Loose:
    """The loose columns of items, at prior variances of their coefficients.

    `lam` is the prior variance times the squared length of each axis, shape (m, t, j).
    """

    def __init__(self, products: Products, variance: Float[np.ndarray, "m t"]):
        self.products, self.variance = products, variance[..., None]
        self.lam = self.variance * products.square[:, None]
        te, tu = products.te, products.tu
        self._pairs = np.stack([te**2, te * tu, tu**2, products.square], axis=1)

    def given(self, noise: Float[np.ndarray, "*k m t"]) -> _Given:
        """Return the products at noise variances."""
        inside = noise[..., None] + self.lam
        log_det = np.sum(np.log(inside / noise[..., None]), axis=-1)
        taken = self._pairs @ np.swapaxes(self.variance / inside, -1, -2)
        ee, eu, uu, used = np.moveaxis(taken, -2, 0)
        all_ee, all_eu, all_uu = (each[:, None] for each in self.products[:3])
        return _Given(log_det, all_ee - ee, all_eu - eu, all_uu - uu, used)


def _amplitude(given: _Given, variance, prior: Amplitudes):
    """Return precision, score and mean of an amplitude: likelihood times prior."""
    precision = given.uu / variance + prior.precision + _TINY
    score = given.eu / variance + prior.precision * prior.mean
    return precision, score, score / precision


def log_marginal(
    count: int,
    products: Products,
    variance: Float[np.ndarray, "m t"],
    prior: Amplitudes,
    sigma: Any,
) -> Marginal:
    """Return the log marginal likelihood of each item in `count` rows.

    Given are prior variances of the coefficients of loose columns, priors of the
    amplitudes, and the frozen distribution of the noise sd [N].
    """
    if not products.ee.size:
        return Marginal(*3 * [np.zeros(variance.shape)])
    prior = Amplitudes(*(column[:, None] for column in prior))
    loose = _Loose(products, variance)
    noise = _likeliest_variance(count, loose, prior)
    centre = 0.5 * np.log(noise)
    width = _WIDER / np.sqrt(2.0 * max(count - 4.0, 2.0))
    reach = _REACH * width
    grid = np.linspace(centre.min() - reach, centre.max() + reach, _POINTS)
    log_prior = sigma.logpdf(np.exp(grid)) + grid
    nodes = _NODES[:, None, None]
    log_sd = centre + np.sqrt(2.0) * width * nodes
    value = _log_density(count, log_sd, loose, prior)
    value += np.interp(log_sd, grid, log_prior)
    value += np.log(_WEIGHTS)[:, None, None] + nodes**2
    log_evidence = np.logaddexp.reduce(value, axis=0)
    log_evidence += 0.5 * np.log(2.0 * width**2) - 0.5 * count * _LOG_2PI
    precision, _, mean = _amplitude(loose.given(noise), noise, prior)
    return Marginal(log_evidence, mean, precision**-0.5)


def _likeliest_variance(count: int, loose: _Loose, prior: Amplitudes):
    """Return the noise variance at which the likelihood is largest, approximately."""
    square = loose.products.ee[:, None]
    variance = np.broadcast_to(square / count, loose.lam.shape[:-1])
    for _ in range(_STEPS):
        given = loose.given(variance)
        size = np.clip(_amplitude(given, variance, prior)[2], prior.low, prior.high)
        left = given.ee - 2.0 * size * given.eu + size**2 * given.uu
        free = np.maximum(count - given.used, 1.0)
        variance = np.maximum(left, 1e-9 * square) / free
    return variance


def _log_density(count: int, log_sd, loose: _Loose, prior: Amplitudes):
    """Return the log density of the readings given the noise sd, less log 2π terms."""
    variance = np.exp(2.0 * log_sd)
    given = loose.given(variance)
    precision, score, mean = _amplitude(given, variance, prior)
    mass, root = 0.0, np.sqrt(precision)
    # Amplitudes of spaces have no bounds.
    if np.any(np.isfinite(prior.low) | np.isfinite(prior.high)):
        mass = log_interval((prior.low - mean) * root, (prior.high - mean) * root)
    value = -count * log_sd - 0.5 * given.log_det - 0.5 * given.ee / variance
    value += 0.5 * score * mean - 0.5 * prior.precision * prior.mean**2
    return value + 0.5 * (_LOG_2PI - np.log(precision)) + mass + prior.log_height
