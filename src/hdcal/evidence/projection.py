"""Inner products of whitened curves beside the base and a context."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from hdcal.evidence.linear_problem import LinearProblem
from hdcal.evidence.noise_models import NoiseModel
from hdcal.evidence.parts import Context
from hdcal.inference.serial_correlation import log_volume


class Axes(NamedTuple):
    """Principal axes of columns beside the base.

    Attributes:
        square: their squared lengths, shape (s, j).
        rotation: from the columns to the axes, shape (s, j, j).
        inside: products of the columns with what the base spans, shape (s, j, p).
        along_y: products of the columns with the readings, base included, (s, j).
    """

    square: Float[np.ndarray, "s j"]
    rotation: Float[np.ndarray, "s j j"]
    inside: Float[np.ndarray, "s j p"]
    along_y: Float[np.ndarray, "s j"]

    def products(
        self, along: Float[np.ndarray, "s j"], base: Float[np.ndarray, "s p"]
    ) -> Float[np.ndarray, "s j"]:
        """Return products of the axes, at their lengths, with a curve for each space.

        Args:
            along: products of the columns with the curves, base included.
            base: products of the curves with what the base spans.
        """
        left = along - np.einsum("sjp,sp->sj", self.inside, base)
        return np.einsum("sj,sjk->sk", left, self.rotation)


class Curves(NamedTuple):
    """Products of whitened errors and slopes.

    Attributes:
        ee: of error and error beside the base, shape (m,).
        eu: of error and slope, likewise.
        uu: of slope and slope, likewise.
        error_q: of errors and what the base spans, shape (m, p).
        slope_q: of slopes and what the base spans, likewise.
    """

    ee: Float[np.ndarray, " m"]
    eu: Float[np.ndarray, " m"]
    uu: Float[np.ndarray, " m"]
    error_q: Float[np.ndarray, "m p"]
    slope_q: Float[np.ndarray, "m p"]


class Projection:
    """The base and a context under one model of the noise.

    Attributes:
        problem: the case.
        noise: model of the noise.
        q: what the base spans, above its priors, shape (n, p).
        y: whitened readings, less the context's offset, shape (n,).
        y_q: their products with q, shape (p,).
        square: their square beside the base.
        constant: part of every log evidence: priors and volume of the whitening.
    """

    def __init__(self, problem: LinearProblem, noise: NoiseModel, context: Context):
        self.problem, self.noise = problem, noise
        columns = np.concatenate([problem.X.T, context.columns])
        held = np.full(len(columns), problem.noise_sd)
        stacked = np.vstack([self.whiten(columns).T, np.diag(held)])
        q, r = np.linalg.qr(stacked)
        self.q = q[: len(problem.y)]
        self.y = self.whiten(problem.y - context.offset)
        self.y_q = self.y @ self.q
        self.square = float(self.y @ self.y - self.y_q @ self.y_q)
        volume = log_volume(np.sum(problem.before >= 0), noise.correlation)
        log_det = np.sum(np.log(np.abs(np.diag(r)))) - np.sum(np.log(held))
        counting = noise.weight[noise.weight > 0.0]
        constant = np.sum(np.log(counting)) - float(volume) - log_det
        self.constant = float(constant) + noise.log_prior

    def whiten(self, curves):
        """Return curves, rows last, in which the noise is independent."""
        return self.problem.whiten(curves, self.noise.weight, self.noise.correlation)

    def curves(
        self, offset: Float[np.ndarray, "m n"], slope: Float[np.ndarray, "m n"]
    ) -> "Curves":
        """Return products of the errors, the readings less offsets, and of slopes."""
        error = self.y - offset
        error_q, slope_q = self.y_q - offset @ self.q, slope @ self.q

        def product(a, b, a_q, b_q):
            return np.einsum("mn,mn->m", a, b) - np.einsum("mp,mp->m", a_q, b_q)

        return Curves(
            product(error, error, error_q, error_q),
            product(error, slope, error_q, slope_q),
            product(slope, slope, slope_q, slope_q),
            error_q,
            slope_q,
        )

    def axes(
        self, white: Float[np.ndarray, "s j n"], gram: Float[np.ndarray, "s j j"]
    ) -> Axes:
        """Return the principal axes of whitened columns.

        Args:
            white: the columns.
            gram: their inner products, base included.
        """
        flat = white.reshape(-1, white.shape[-1])
        # Through all columns once: of many rows they take longer to read than to use.
        found = flat @ np.column_stack([self.q, self.y])
        found = found.reshape(*white.shape[:-1], found.shape[1])
        inside = found[..., :-1]
        left = gram - inside @ np.swapaxes(inside, 1, 2)
        square, rotation = np.linalg.eigh(left)
        return Axes(np.maximum(square, 0.0), rotation, inside, found[..., -1])
