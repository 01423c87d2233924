"""The rows of a case and the linearised base model: whitening and projection."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import cho_solve

from hdcal.data.records import Array
from hdcal.inference import serial_correlation

# AR(1) coefficients of the noise within a run that are always integrated over; more
# would explain slow physics as noise where a half cycle has few rows.
CORRELATIONS = (0.0, 0.2, 0.4, 0.6)


@dataclass(frozen=True)
class LinearRows:
    """The data of one case and the linear base model that every hypothesis contains.

    Attributes:
        reading: measured force less the prior mean of the base model [N].
        base: columns of the base model [N per prior sd of each coefficient].
        precision: prior precision of the coefficients times the noise variance.
        before: index of the row before in the same run, −1 for a run's first.
        weight: one over the relative noise sd of each row [-].
        correlations: AR(1) coefficients.
        tolerance: smooth functions of unit mean square, shape (j, n), with which an
            effect's shape may differ from the library's.
    """

    reading: Float[np.ndarray, " n"]
    base: Float[np.ndarray, "n p"]
    precision: Float[np.ndarray, " p"]
    before: Int[np.ndarray, " n"]
    weight: Float[np.ndarray, " n"]
    correlations: Float[np.ndarray, " r"]
    tolerance: Float[np.ndarray, "j n"]
    _whitened_base: dict = field(init=False, default_factory=dict, repr=False)

    def whitened_base(self, correlation: float) -> tuple[np.ndarray, np.ndarray]:
        """Return Q and R of the whitened base above its priors, kept once computed."""
        if correlation not in self._whitened_base:
            white = whiten(self, self.base, correlation)
            self._whitened_base[correlation] = np.linalg.qr(_stacked(self, white))
        return self._whitened_base[correlation]

    @cached_property
    def root(self) -> np.ndarray:
        """The upper triangular R with R'R = X'X + S⁻¹, shape (p, p).

        Readings without noise leave next to nothing of the priors: the sum itself
        would be singular by rounding.
        """
        return np.asarray(np.linalg.qr(_stacked(self, self.base), mode="r"))


def whiten(rows: LinearRows, columns: np.ndarray, correlation: float) -> np.ndarray:
    """Return columns in which the noise is independent and of equal sd.

    Args:
        rows: order and weights of the rows.
        columns: with the rows along their first axis.
        correlation: AR(1) coefficient of the noise within a run.
    """
    scaled = columns * rows.weight.reshape(-1, *(1,) * (columns.ndim - 1))
    return serial_correlation.whiten(scaled, rows.before, correlation)


def log_det_whitening(
    rows: LinearRows, correlation: Float[Array, "*r"] | float
) -> Float[np.ndarray, "*r"]:
    """Return log |d whitened / d reading| at one or several correlations."""
    following = np.sum(rows.before >= 0)
    volume = serial_correlation.log_volume(following, correlation)
    return np.sum(np.log(rows.weight)) - np.asarray(volume)


def log_det_projection(rows: LinearRows, correlation: float) -> float:
    """Return log |P| for P = (I + X S X')⁻¹ in whitened rows.

    The base coefficients have prior precision `rows.precision`/σ²; zero columns change
    nothing.
    """
    _, factor = rows.whitened_base(correlation)
    prior = np.sum(np.log(rows.precision))
    return float(prior - 2.0 * np.sum(np.log(np.abs(np.diag(factor)))))


def remove_base(
    rows: LinearRows, curves: Float[np.ndarray, "g n"]
) -> Float[np.ndarray, "g n"]:
    """Return what of each curve the base model cannot absorb: its visible size [N].

    As far as its priors let it: no zero of the deformation makes up for a drift with
    temperature.
    """
    base = rows.base
    return curves - (curves @ base) @ cho_solve((rows.root, False), base.T)


def restore_base(
    rows: LinearRows, left: Float[np.ndarray, "g n"]
) -> Float[np.ndarray, "g n"]:
    """Return the curves of which `remove_base` leaves these: I + X S X' is inverse."""
    return left + (left @ rows.base / rows.precision) @ rows.base.T


def project(
    rows: LinearRows, correlation: float, curves: Float[np.ndarray, "g n"]
) -> Float[np.ndarray, "g n+p"]:
    """Return curves whose inner products are those of P, not of P P.

    P = (I + X S X')⁻¹ is no projection where the priors hold the base coefficients
    back. It is one of rows and priors together: what those cost is kept in as many
    further entries as the base has columns.
    """
    white = whiten(rows, curves.T, correlation).T
    axes, _ = rows.whitened_base(correlation)
    left = -(white @ axes[: white.shape[1]]) @ axes.T
    left[:, : white.shape[1]] += white
    return left


def _stacked(rows: LinearRows, base: Float[np.ndarray, "n p"]) -> np.ndarray:
    """Return the base's columns above what its priors hold them with, (n + p, p)."""
    return np.vstack([base, np.diag(np.sqrt(rows.precision))])
