"""The slow way to every evidence: dense covariance matrices and fine grids."""

import numpy as np
from rigs import cycles, make_case, make_gear
from scipy import linalg, stats
from scipy.special import logsumexp

from hdcal.data.priors import effect_priors
from hdcal.evidence.linear_rows import remove_base
from hdcal.evidence.prepare import PreparedCase, prepare
from hdcal.inference.distributions import frozen

NOISE = 0.4


def prepared_case(added=0.0, *, rows=24, correlation=0.0, seed=4) -> PreparedCase:
    """Return a small case of cycles with AR(1) noise and something added [N]."""
    records = cycles(rows)
    rng = np.random.default_rng(seed)
    noise = rng.normal(0.0, NOISE, rows)
    for row in range(1, rows):
        noise[row] *= np.sqrt(1.0 - correlation**2)
        noise[row] += correlation * noise[row - 1]
    rise = records.temperature - 20.0
    force = 195.0 * records.deformation * (1.0 - 3e-4 * rise) + 1.0 + added + noise
    case = make_case(records, make_gear())
    object.__setattr__(case.records, "force", force)
    return prepare(case, effect_priors(), NOISE)


def covariance(rows, correlation: float) -> np.ndarray:
    """Return the covariance of the readings beside σ²: serial noise and base model."""
    size = len(rows.reading)
    run = np.cumsum(np.asarray(rows.before) < 0)
    lag = np.abs(np.arange(size)[:, None] - np.arange(size))
    serial = np.where(run[:, None] == run, correlation**lag, 0.0)
    sd = 1.0 / np.asarray(rows.weight)
    base = np.asarray(rows.base) / np.sqrt(np.asarray(rows.precision))
    return sd[:, None] * serial * sd + base @ base.T


def noise_grid(prior, centre=NOISE, count=49):
    """Return values of σ and log prior weights of each on a fine grid."""
    log_sd = np.log(centre) + np.linspace(-1.6, 1.6, count)
    sd = np.exp(log_sd)
    step = np.log(log_sd[1] - log_sd[0])
    return sd, frozen(prior).logpdf(sd) + log_sd + step


def wiggles(rows, shape) -> np.ndarray:
    """Return what one unit of tolerance adds per unit of the amplitude [N]."""
    left = remove_base(rows, shape[None])[0]
    return left * np.asarray(rows.tolerance)


def log_normal(target: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Return log N(column; 0, matrix) of each column of the target."""
    factor = linalg.cholesky(matrix, lower=True)
    white = linalg.solve_triangular(factor, target, lower=True)
    volume = np.sum(np.log(np.diag(factor)))
    constant = 0.5 * len(matrix) * np.log(2.0 * np.pi)
    return -0.5 * np.sum(white**2, axis=0) - volume - constant


def line_integral(
    rows, slope, grid, sigma, correlation, tolerance, scales, weights, *, cells=True
):
    """Integrate one linear effect over amplitude, prior scale and noise.

    Args:
        rows: the data.
        slope: contribution per unit of the amplitude [N].
        grid: of the effect: its prior sd and whether it is half normal.
        sigma: prior of the noise sd.
        correlation: AR(1) coefficient.
        tolerance: relative sd of the shape.
        scales: factors on the prior sd.
        weights: their probabilities.
        cells: the tolerance goes with the middle of the amplitude's cell, as it is
            defined; else with the amplitude itself, as it is meant.
    """
    low, high = grid.edges[:-1], grid.edges[1:]
    parts = np.linspace(low, high, 33).T
    fixed, loose = covariance(rows, correlation), wiggles(rows, slope)
    loose = loose.T @ loose
    reading = np.asarray(rows.reading)[:, None]
    total = []
    for sd, log_weight in zip(*noise_grid(sigma), strict=True):
        for size, middle in zip(parts, np.abs(low + high) / 2.0, strict=True):
            prior = amplitude_prior(grid, size, scales, weights)
            target = reading - slope[:, None] * size
            if cells or tolerance == 0.0:
                wide = (tolerance * middle) ** 2 * loose
                height = log_normal(target, sd**2 * fixed + wide)
            else:
                height = [
                    log_normal(one, sd**2 * fixed + (tolerance * a) ** 2 * loose)
                    for one, a in zip(target.T, size, strict=True)
                ]
            total.append(log_integral(height + np.log(prior), size) + log_weight)
    return float(logsumexp(total))


def amplitude_prior(grid, size, scales, weights) -> np.ndarray:
    """Return the prior density of a zero-centred amplitude of uncertain scale."""
    density = sum(
        w * stats.norm.pdf(size, 0.0, s * grid.sd)
        for s, w in zip(scales, weights, strict=True)
    )
    return density * (2.0 if grid.one_sided else 1.0)


def log_integral(height: np.ndarray, place: np.ndarray) -> float:
    """Return log ∫ exp(height) by the trapezoid rule."""
    top = height.max()
    return float(top + np.log(np.trapezoid(np.exp(height - top), place)))
