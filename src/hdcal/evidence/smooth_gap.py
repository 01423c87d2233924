"""The smooth gap and its shares by covariate: an additive Gaussian process.

Gap = Σ_c f_c with f_c = B_c w_c, w_c ~ N(0, τ_c²), orthogonal to the base model;
Gibbs sampling of weights, scales and noise in whitened rows.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from hdcal.evidence.kernels import kernel_columns, visible_kernels
from hdcal.evidence.linear_rows import project, restore_base
from hdcal.evidence.prepare import PreparedCase

# Which covariate each kernel belongs to.
COVARIATES = {
    "deformation": "deformation",
    "temperature": "temperature",
    "order in run": "time",
    "order": "time",
    "angle": "angle",
    "rate": "rate",
    "direction": "direction",
    "deformation × direction": "direction",
    "deformation × temperature": "temperature",
    "run": "run",
    "specimen": "specimen",
}
_WIDTH = 8
# Prior scale of a component in noise sds: of a gap that has been detected, and of a
# remainder beside an effect, where noise must not be called a gap.
DETECTED, REMAINDER = 0.1, 0.03
_DRAWS, _BURN_IN = 150, 50


@dataclass(frozen=True)
class SmoothGap:
    """Posterior draws of the smooth gap.

    Attributes:
        shares: part of the gap's mean square along each covariate, shape (d,) each.
        rms: of the gap [N], shape (d,).
        mean: of the gap at the rows [N], shape (n,).
        variance: of a reading's noise beside the smooth gap [N²], shape (d,).
        noise_sd: point estimate of it, from the residuals and the degrees of freedom
            that the base model and the smooth gap use up [N].
    """

    shares: dict[str, Float[np.ndarray, " d"]]
    rms: Float[np.ndarray, " d"]
    mean: Float[np.ndarray, " n"]
    variance: Float[np.ndarray, " d"]
    noise_sd: float


@dataclass(frozen=True)
class AdditiveBasis:
    """Columns of all components [N], shape (k, n), and which kernel each is of."""

    names: tuple[str, ...]
    columns: Float[np.ndarray, "k n"]
    groups: Int[np.ndarray, " k"]


def additive_basis(case: PreparedCase) -> AdditiveBasis:
    """Return the components that these rows can show beside the base model."""
    names, columns = visible_kernels(case.rows, kernel_columns(case.records), _WIDTH)
    kept = [i for i, name in enumerate(names) if name in COVARIATES]
    groups = np.repeat(np.arange(len(kept)), _WIDTH)
    flat = columns[kept].reshape(-1, columns.shape[-1])
    used = np.any(flat != 0.0, axis=1)
    return AdditiveBasis(tuple(names[i] for i in kept), flat[used], groups[used])


def fit_smooth_gap(
    case: PreparedCase,
    basis: AdditiveBasis,
    correlation: float,
    rng: np.random.Generator,
    reading: Float[np.ndarray, " n"] | None = None,
    floor: float = DETECTED,
) -> SmoothGap:
    """Draw the smooth gap between readings and base model.

    Args:
        case: whose gap it is.
        basis: of the components.
        correlation: AR(1) coefficient of the noise.
        rng: source of randomness.
        reading: to fit instead of the case's own [N].
        floor: prior scale of a component in noise sds.
    """
    rows, columns, groups = case.rows, basis.columns, basis.groups
    target = rows.reading if reading is None else reading
    # What was put in is seen as the base model leaves it, so that it is weighed whole.
    whole = restore_base(rows, columns)
    white = project(rows, correlation, np.concatenate([target[None], whole])).T
    draws, variance, used = _gibbs(
        white[:, 0], white[:, 1:], groups, case.noise_sd, floor, rng
    )
    parts = [draws * (groups == g) for g in range(len(basis.names))]
    size = np.array([np.mean((part @ columns) ** 2, axis=1) for part in parts])
    total = np.maximum(size.sum(axis=0), 1e-300)
    shares: dict[str, Float[np.ndarray, " d"]] = {}
    for name, each in zip(basis.names, size / total, strict=True):
        covariate = COVARIATES[name]
        shares[covariate] = shares.get(covariate, 0.0) + each
    curve = draws @ columns
    left = white[:, 0] - white[:, 1:] @ draws.mean(axis=0)
    freedom = max(len(target) - used, 1.0)
    return SmoothGap(
        shares,
        np.sqrt(np.mean(curve**2, axis=1)),
        curve.mean(axis=0),
        variance,
        float(np.sqrt(np.sum(left**2) / freedom)),
    )


def _gibbs(target, columns, groups, noise_sd: float, floor: float, rng):
    """Draw weights given inverse-gamma(½, b/2) scales: half-Cauchy-like, from zero."""
    gram, product = columns.T @ columns, columns.T @ target
    rows = np.linalg.qr(columns, mode="r")
    count = np.bincount(groups)
    least = (floor * noise_sd) ** 2 / 2.0
    scale, variance = np.full(len(count), noise_sd**2), noise_sd**2
    draws, noise, kept = [], [], []
    for step in range(_DRAWS + _BURN_IN):
        # By QR: the sum of both squares would lose the smaller one where readings are
        # nearly interpolated.
        stacked = np.vstack([rows / np.sqrt(variance), np.diag(scale[groups] ** -0.5)])
        upper = np.asarray(np.linalg.qr(stacked, mode="r"))
        upper *= np.sign(np.diag(upper))[:, None]
        centre = np.linalg.solve(upper.T, product / variance)
        weights = np.linalg.solve(upper, centre + rng.normal(size=len(centre)))
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
