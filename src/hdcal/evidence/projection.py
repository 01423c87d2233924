"""Evidence of items in whitened rows, with the base and a context projected out."""

from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Float, Int

from hdcal.evidence.items import Amplitudes
from hdcal.evidence.linear_problem import LinearProblem
from hdcal.evidence.marginal import Marginal, Products, log_marginal
from hdcal.evidence.noise_models import NoiseModel
from hdcal.evidence.parts import Context
from hdcal.inference.force_model.serial_correlation import log_volume


class Block(NamedTuple):
    """Items with the same number of loose columns; the base alone has owner −1."""

    owner: Int[np.ndarray, " m"]
    amplitude: Amplitudes
    variance: Float[np.ndarray, "m t"]
    log_weight: Float[np.ndarray, "m t"]
    offset: Float[np.ndarray, "m n"]
    slope: Float[np.ndarray, "m n"]
    loose: Float[np.ndarray, "m j n"]


class _Curves(NamedTuple):
    """Products of errors and slopes less the base, and with what the base spans."""

    ee: Float[np.ndarray, " m"]
    eu: Float[np.ndarray, " m"]
    uu: Float[np.ndarray, " m"]
    error_q: Float[np.ndarray, "m p"]
    slope_q: Float[np.ndarray, "m p"]


class Projection:
    """The base and a context under one model of the noise.

    `square` is that of the whitened readings with the base projected out, `constant`
    the part of every log evidence that priors and the volume of the whitening make.
    """

    def __init__(self, problem: LinearProblem, noise: NoiseModel, context: Context):
        self.problem, self.noise = problem, noise
        columns = np.concatenate([problem.X.T, context.columns])
        held = np.full(len(columns), problem.noise_sd)
        stacked = np.vstack([self.whiten(columns).T, np.diag(held)])
        q, r = np.linalg.qr(stacked)
        # What the base spans, above its priors, and the readings along it.
        self._q = q[: len(problem.y)]
        self._y = self.whiten(problem.y - context.offset)
        self._y_q = self._y @ self._q
        self.square = float(self._y @ self._y - self._y_q @ self._y_q)
        volume = log_volume(np.sum(problem.before >= 0), noise.correlation)
        log_det = np.sum(np.log(np.abs(np.diag(r)))) - np.sum(np.log(held))
        counting = noise.weight[noise.weight > 0.0]
        constant = np.sum(np.log(counting)) - float(volume) - log_det
        self.constant = float(constant) + noise.log_prior

    def whiten(self, curves):
        """Return curves, rows last, in which the noise is independent."""
        return self.problem.whiten(curves, self.noise.weight, self.noise.correlation)

    def evaluate(self, block: Block, only: set[int] | None = None) -> Marginal:
        """Return the evidence of items with their prior, of some components."""
        rows = slice(None)
        if only is not None:
            rows = np.flatnonzero(np.isin(block.owner, [*only, -1]))
        some = jax.tree.map(lambda column: column[rows], block)
        offset, slope, loose = map(self.whiten, (some.offset, some.slope, some.loose))
        curves = self._curves(offset, slope)
        # Through all columns once: of many rows they take longer to read than to use.
        flat = loose.reshape(-1, loose.shape[-1])
        along = flat @ np.column_stack([self._q, self._y])
        along = along.reshape(*loose.shape[:-1], along.shape[1])
        inside, along_y = along[..., :-1], along[..., -1]
        gram = loose @ np.swapaxes(loose, 1, 2) - inside @ np.swapaxes(inside, 1, 2)
        square, rotation = np.linalg.eigh(gram)

        def of_axes(columns, base):
            left = columns - np.einsum("sjp,sp->sj", inside, base)
            return np.einsum("sj,sjk->sk", left, rotation)

        def with_loose(curves):
            return (loose @ curves[..., None])[..., 0]

        products = Products(
            *curves[:3],
            of_axes(along_y - with_loose(offset), curves.error_q),
            of_axes(with_loose(slope), curves.slope_q),
            np.maximum(square, 0.0),
        )
        found = self._marginal(products, some.variance, some.amplitude)
        weighted = found.log_evidence + some.log_weight
        found = found._replace(log_evidence=weighted)
        if only is None:
            return found
        table = np.full((3, *block.variance.shape), -np.inf)
        table[:, rows] = found
        return Marginal(*table)

    def evaluate_curves(
        self,
        offset: Float[np.ndarray, "c n"],
        slope: Float[np.ndarray, "c n"],
        curve: Int[np.ndarray, " m"],
        amplitude: Amplitudes,
    ) -> Marginal:
        """Return the evidence of curves without loose columns, shape (m, 1)."""
        curves = self._curves(self.whiten(offset), self.whiten(slope))
        none = np.zeros((len(curve), 0))
        ee, eu, uu = (each[curve] for each in curves[:3])
        products = Products(ee, eu, uu, none, none, none)
        return self._marginal(products, np.zeros((len(curve), 1)), amplitude)

    def _marginal(self, products: Products, variance, amplitude) -> Marginal:
        problem = self.problem
        given = products, variance, amplitude, problem.noise_prior
        found = log_marginal(problem.count, *given)
        return found._replace(log_evidence=found.log_evidence + self.constant)

    def _curves(self, offset, slope) -> _Curves:
        """Return products of the errors, the readings less offsets, and of slopes."""
        error = self._y - offset
        error_q, slope_q = self._y_q - offset @ self._q, slope @ self._q

        def product(a, b, a_q, b_q):
            return np.einsum("mn,mn->m", a, b) - np.einsum("mp,mp->m", a_q, b_q)

        return _Curves(
            product(error, error, error_q, error_q),
            product(error, slope, error_q, slope_q),
            product(slope, slope, slope_q, slope_q),
            error_q,
            slope_q,
        )
