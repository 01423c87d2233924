"""Least squares, effect by effect: the simpler ways of choosing a cause."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import jax
import numpy as np
from scipy import stats

from benchmarks.blind.label import NONE
from hdcal.data.case import Case
from hdcal.data.prior import Prior
from hdcal.data.priors import effect_priors
from hdcal.physics.chain import Base, Reading, predict_reading
from hdcal.physics.effect import Effect, parameters
from hdcal.screening.turning_points import MEDIAN_SIZE

Library = Mapping[str, type[Effect]]
# Slope and offset are free; the loss of modulus is held by its prior.
_FREE = 2
# Quantiles of a prior at which shapes and amplitudes are tried.
_SHAPES = np.linspace(0.05, 0.95, 7)
_AMPLITUDES = (0.25, 0.75, 0.98)


@dataclass(frozen=True)
class LeastSquares:
    """The best fit of one effect together with slope, offset and loss of modulus.

    Attributes:
        square: sum of squared residuals [N²].
        parameters: number of fitted parameters, shapes included.
        rows: number of readings.
    """

    square: float
    parameters: int
    rows: int

    @property
    def bic(self) -> float:
        """Bayesian information criterion, up to a constant."""
        spread = max(self.square / self.rows, 1e-300)
        return self.rows * np.log(spread) + self.parameters * np.log(self.rows)


@dataclass(frozen=True)
class _Straight:
    """The straight model of a case: slope, zero and loss of modulus.

    Attributes:
        base: fitted parameters of the force model.
        reading: how the rig reads.
        columns: orthonormal, with a row for the prior below the readings, (n + 1, 3).
        left: readings less what they absorb, shape (n + 1,).
    """

    base: Base
    reading: Reading
    columns: np.ndarray
    left: np.ndarray


def fit_each(
    case: Case, library: Library, noise_sd: float | None = None
) -> dict[str, LeastSquares]:
    """Fit every testable effect on the mean reading, and none, by least squares.

    Args:
        case: from `read_case`.
        library: effects to fit, by name.
        noise_sd: weight of the prior of the loss of modulus [N]; estimated if None.
    """
    straight, rows = _straight(case, noise_sd), len(case.records.force)
    found = {NONE: LeastSquares(_square(straight.left), _FREE, rows)}
    for name, effect in library.items():
        if effect.stage == "noise" or not effect.needs <= case.records.known:
            continue
        tables, shapes = _tables(effect, case, straight)
        square = min(_square_left(straight, table) for table in tables)
        count = _FREE + tables.shape[1] + min(shapes, 1)
        found[name] = LeastSquares(square, count, rows)
    return found


def closable(case: Case, library: Library, noise_sd: float) -> dict[str, float]:
    """Return the share of a gap without noise that each effect can close.

    Args:
        case: with readings without noise.
        library: the effects; those that cannot be tested are left out.
        noise_sd: of the readings whose gap it was [N].

    Returns:
        1 − RMS after over RMS before, by effect.
    """
    found = fit_each(case, library, noise_sd)
    whole = found.pop(NONE).square
    if whole <= 0.0:
        return {}
    return {n: 1.0 - float(np.sqrt(fit.square / whole)) for n, fit in found.items()}


def _straight(case: Case, noise_sd: float | None) -> _Straight:
    records, gear = case.records, case.gear
    x, force = np.asarray(records.deformation), np.asarray(records.force)
    rise = np.asarray(records.temperature) - gear.reference_temperature
    slope, zero = np.polyfit(x, force, 1)
    alpha = _distribution(gear.priors["alpha"])
    if noise_sd is None:
        bends = np.diff(force - slope * x * (1.0 - alpha.mean() * rise), 2)
        # The spread of second differences, which a smooth gap hardly touches.
        noise_sd = float(np.median(np.abs(bends)) / (MEDIAN_SIZE * np.sqrt(6.0)))
    warm = slope * x * rise * alpha.std()
    held = max(noise_sd, 1e-6 * float(np.max(np.abs(force))))
    table = np.stack([x, np.ones_like(x), warm], axis=1)
    padded = np.vstack([table, [0.0, 0.0, held]])
    columns = np.linalg.qr(padded)[0]
    start = np.append(force + slope * x * rise * alpha.mean(), 0.0)
    per_read = 0.5 if gear.reading == "diametral" else 1.0
    base = Base(slope / per_read, alpha.mean(), 0.0, zero, noise_sd)
    left = start - columns @ (columns.T @ start)
    return _Straight(base, Reading(per_read, gear.reference_temperature), columns, left)


def _tables(
    effect: type[Effect], case: Case, straight: _Straight
) -> tuple[np.ndarray, int]:
    """Return columns of an effect at several shapes, and its number of shapes.

    Columns have free coefficients, shape (shapes, columns, n): one for each amplitude,
    or for each member that differs.
    """
    priors = {**effect_priors(case.gear.full_scale), **case.gear.effect_priors}
    laws = {p: _distribution(priors[f"{effect.name}.{p}"]) for p in parameters(effect)}
    null = {p: about.null for p, about in parameters(effect).items()}
    shapes = {p: laws[p].ppf(_SHAPES) for p, value in null.items() if value is None}
    amplitudes = [p for p, value in null.items() if value is not None]
    many = len(amplitudes) > 1
    sizes = (0.84,) if many else _AMPLITUDES
    points = [
        {**null, **dict(zip(shapes, point, strict=True)), name: laws[name].ppf(size)}
        for *point, size in product(*shapes.values(), sizes)
        for name in amplitudes
    ]
    made = effect(**{p: np.array([point[p] for point in points]) for p in null})
    curves = np.asarray(_curves(made, straight.base, case.records, straight.reading))
    tables = curves.reshape(-1, len(amplitudes), curves.shape[-1])
    if (members := getattr(effect, "members", None)) is not None:
        label = np.asarray(getattr(case.records, members))
        tables = tables[:1] * (label == np.unique(label)[:, None])
    return tables, len(shapes)


@jax.jit
def _curves(effects: Effect, base: Base, records, reading: Reading):
    """Return what effects add to the mean reading [N], shape (points, n)."""
    plain = predict_reading(base, (), records, reading)[0]

    def added(effect):
        return predict_reading(base, (effect,), records, reading)[0] - plain

    return jax.vmap(added)(effects)


def _distribution(prior: Prior):
    """Return a prior as a distribution of SciPy."""
    numbers = [float(number) for number in prior.numbers]
    match prior.family:
        case "normal":
            return stats.norm(*numbers)
        case "lognormal":
            return stats.lognorm(numbers[1], scale=numbers[0])
        case "half_normal":
            return stats.halfnorm(scale=numbers[0])
        case "uniform":
            return stats.uniform(numbers[0], numbers[1] - numbers[0])
        case "beta":
            return stats.beta(*numbers)
    # A fixed value.
    return stats.norm(numbers[0], 1e-12 * max(abs(numbers[0]), 1.0))


def _square_left(straight: _Straight, table: np.ndarray) -> float:
    """Return the least sum of squares with columns (k, n) added."""
    padded = np.pad(table, ((0, 0), (0, 1))).T
    padded = padded - straight.columns @ (straight.columns.T @ padded)
    size = np.linalg.norm(padded, axis=0)
    padded = padded / np.where(size > 0.0, size, 1.0)
    fitted = padded @ np.linalg.lstsq(padded, straight.left, rcond=1e-9)[0]
    return _square(straight.left - fitted)


def _square(values: np.ndarray) -> float:
    return float(values @ values)
