"""Inner products of whitened curves beside the base and a context."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from hdcal.evidence.linear_problem import LinearProblem
from hdcal.evidence.marginal import Products, log_marginal
from hdcal.evidence.noise_models import NoiseModel
from hdcal.evidence.parts import Context
from hdcal.inference.serial_correlation import log_volume


class Projection:
    """The base and a context under one model of the noise.

    Attributes:
        problem: the case.
        noise: model of the noise.
        q: what the base spans, above its priors, shape (n, p).
        y: whitened readings, less the context's offset, shape (n,).
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
        along = self.y @ self.q
        self.square = float(self.y @ self.y - along @ along)
        volume = log_volume(np.sum(problem.before >= 0), noise.correlation)
        log_det = np.sum(np.log(np.abs(np.diag(r)))) - np.sum(np.log(held))
        counting = noise.weight[noise.weight > 0.0]
        constant = np.sum(np.log(counting)) - float(volume) - log_det
        self.constant = float(constant) + noise.log_prior

    def whiten(self, curves):
        """Return curves, rows last, in which the noise is independent."""
        return self.problem.whiten(curves, self.noise.weight, self.noise.correlation)

    def products(self, error, slope) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return products of whitened errors and slopes (m, n) beside the base.

        Returns:
            Error with error, error with slope and slope with slope, each (m, 1).
        """
        error_q, slope_q = error @ self.q, slope @ self.q

        def product(a, b, a_q, b_q):
            return (np.sum(a * b, axis=1) - np.sum(a_q * b_q, axis=1))[:, None]

        return (
            product(error, error, error_q, error_q),
            product(error, slope, error_q, slope_q),
            product(slope, slope, slope_q, slope_q),
        )

    def evidence_of_none(self) -> float:
        """Return the log evidence of base and context alone."""
        none = np.zeros((1, 1, 0))
        products = Products(np.full((1, 1), self.square), none, none)
        found = log_marginal(
            self.problem.count, products, None, self.problem.noise_prior
        )
        return float(found.log_evidence[0, 0]) + self.constant


class Axes(NamedTuple):
    """Principal axes of columns beside the base.

    Attributes:
        square: their squared lengths, shape (s, j).
        products: of the axes, at these lengths, with each of some curves, (s, j).
    """

    square: Float[np.ndarray, "s j"]
    products: list[Float[np.ndarray, "s j"]]


def principal_axes(
    projection: Projection,
    white: Float[np.ndarray, "s j n"],
    gram: Float[np.ndarray, "s j j"],
    curves: Sequence[Float[np.ndarray, "s n"]],
) -> Axes:
    """Return the principal axes of whitened columns.

    Args:
        projection: base, context and noise.
        white: whitened columns.
        gram: their inner products, base included.
        curves: whitened curves of which products are wanted.
    """
    inside = white @ projection.q
    left = gram - inside @ np.swapaxes(inside, 1, 2)
    square, rotation = np.linalg.eigh(left)
    products = []
    for curve in curves:
        along = np.einsum("sjn,sn->sj", white, curve)
        along -= np.einsum("sjp,sp->sj", inside, curve @ projection.q)
        products.append(np.einsum("sj,sjk->sk", along, rotation))
    return Axes(np.maximum(square, 0.0), products)
