"""How the gap's variance is shared by the covariates: an additive Gaussian process.

Gap = Σ_c f_c with f_c = B_c w_c, w_c ~ N(0, τ_c²), orthogonal to the base model;
Gibbs sampling of weights, scales and noise in whitened rows.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from hdcal.data.records import Array
from hdcal.evidence.inner_products import project
from hdcal.evidence.kernels import kernels, visible_kernels
from hdcal.evidence.prepare import Setting
from hdcal.evidence.whitened_rows import beside_line

# Which kernels speak for which covariate; the first match counts.
COVARIATES = {
    "deformation": "deformation",
    "temperature": "temperature",
    "order in run": "time",
    "order": "time",
    "angle": "angle",
    "direction": "direction",
    "deformation × direction": "direction",
    "deformation × temperature": "temperature",
    "run": "run",
    "specimen": "specimen",
}
_WIDTH = 8
# Prior scale of a component in noise sds: of a gap that has been detected, and of a
# remainder beside an effect, where noise must not be called a gap.
DETECTED, REMAINDER = 0.3, 0.03
_DRAWS, _BURN_IN = 150, 50


@dataclass(frozen=True)
class Additive:
    """Posterior draws of the smooth gap.

    Attributes:
        shares: part of the gap's mean square along each covariate, shape (d,) each.
        rms: of the gap [N], shape (d,).
        mean: of the gap at the rows [N], shape (n,).
        variance: of a reading's noise beside the smooth gap [N²], shape (d,).
        noise_sd: point estimate of it, from the residuals and the degrees of freedom
            that the base model and the smooth gap use up [N].
    """

    shares: dict[str, Float[Array, " d"]]
    rms: Float[Array, " d"]
    mean: Float[Array, " n"]
    variance: Float[Array, " d"]
    noise_sd: float


@dataclass(frozen=True)
class Basis:
    """Columns of all components [N], shape (k, n), and which kernel each is of."""

    names: tuple[str, ...]
    columns: Float[Array, "k n"]
    groups: Int[Array, " k"]


def additive_basis(setting: Setting) -> Basis:
    """Return the components that these rows can show beside the base model."""
    names, columns = visible_kernels(
        kernels(setting.records), lambda table: beside_line(setting.rows, table), _WIDTH
    )
    kept = [i for i, name in enumerate(names) if name in COVARIATES]
    groups = np.repeat(np.arange(len(kept)), _WIDTH)
    flat = columns[kept].reshape(-1, columns.shape[-1])
    used = np.any(flat != 0.0, axis=1)
    return Basis(tuple(names[i] for i in kept), flat[used], groups[used])


def fit_additive(
    setting: Setting,
    basis: Basis,
    correlation: float,
    rng: np.random.Generator,
    reading: Float[Array, " n"] | None = None,
    floor: float = DETECTED,
) -> Additive:
    """Draw the smooth gap between readings and base model.

    Args:
        setting: the case.
        basis: of the components.
        correlation: AR(1) coefficient of the noise.
        rng: source of randomness.
        reading: to fit instead of the setting's own [N].
        floor: prior scale of a component in noise sds.
    """
    rows = setting.rows
    columns, groups = np.asarray(basis.columns), np.asarray(basis.groups)
    target = rows.reading if reading is None else reading
    table = np.concatenate([np.asarray(target)[None], columns])
    white = np.asarray(project(rows, correlation, table)).T
    draws, variance, used = _gibbs(
        white[:, 0], white[:, 1:], groups, setting.noise_sd, floor, rng
    )
    parts = [draws * (groups == g) for g in range(len(basis.names))]
    size = np.array([np.mean((part @ columns) ** 2, axis=1) for part in parts])
    total = np.maximum(size.sum(axis=0), 1e-300)
    shares: dict[str, Float[Array, " d"]] = {}
    for name, each in zip(basis.names, size / total, strict=True):
        covariate = COVARIATES[name]
        shares[covariate] = shares.get(covariate, 0.0) + each
    curve = draws @ columns
    left = white[:, 0] - white[:, 1:] @ draws.mean(axis=0)
    freedom = max(len(target) - used, 1.0)
    return Additive(
        shares,
        np.sqrt(np.mean(curve**2, axis=1)),
        curve.mean(axis=0),
        variance,
        float(np.sqrt(np.sum(left**2) / freedom)),
    )


def _gibbs(target, columns, groups, noise_sd: float, floor: float, rng):
    """Draw weights given inverse-gamma(½, b/2) scales: half-Cauchy-like, from zero."""
    gram, product = columns.T @ columns, columns.T @ target
    count = np.bincount(groups)
    least = (floor * noise_sd) ** 2 / 2.0
    scale, variance = np.full(len(count), noise_sd**2), noise_sd**2
    draws, noise, kept = [], [], []
    for step in range(_DRAWS + _BURN_IN):
        factor = np.linalg.cholesky(gram / variance + np.diag(1.0 / scale[groups]))
        centre = np.linalg.solve(factor, product / variance)
        weights = np.linalg.solve(factor.T, centre + rng.normal(size=len(centre)))
        squares = np.bincount(groups, weights**2)
        scale = (least + 0.5 * squares) / rng.gamma(0.5 + 0.5 * count)
        left = target - columns @ weights
        variance = 0.5 * (left @ left) / rng.gamma(0.5 * len(target))
        if step >= _BURN_IN:
            draws.append(weights)
            noise.append(variance)
            kept.append(scale)
    middle = np.exp(np.mean(np.log(kept), axis=0))[groups]
    ridge = np.diag(np.mean(noise) / middle)
    used = float(np.trace(np.linalg.solve(gram + ridge, gram)))
    return np.stack(draws), np.array(noise), used
