"""A linear-Gaussian residual with its standard normal scores integrated out.

In noise sds r = Z w + e. With A = I + Z'Z and u = Z'r:

    log p(r) = −½ [log|A| + r'r − u'A⁻¹u] + constant,   w = A⁻¹u + A^(−½) ξ.

Members of which each row has one have a diagonal block of A: they are eliminated one by
one, at a cost that grows with their number, not its cube. That they sum to zero is one
further observation without noise.
"""

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.scipy.linalg import solve_triangular
from jaxtyping import Float, Int, Key
from scipy.linalg import helmert

from hdcal.data.records import Array


class Grouped(eqx.Module):
    """Members of which each row has one and which sum to zero: runs, or specimens.

    Attributes:
        index: member of each block of rows [-]; blocks have the same number of rows.
        column: contribution of its member to each row [noise sds per prior sd].
        count: number of members [-].
    """

    index: Int[Array, " b"]
    column: Float[Array, " r"]
    count: int = eqx.field(static=True)

    def columns(self) -> Float[Array, "r k"]:
        """Return the contribution of each contrast between the members to each row."""
        return self.column[:, None] * self.to_rows(contrasts(self.count))

    def to_rows(self, members: Float[Array, " count ..."]) -> Float[Array, " r ..."]:
        """Return the value of its member for each row."""
        block = len(self.column) // len(self.index)
        return jnp.repeat(members[self.index], block, axis=0)

    def sums(self, rows: Float[Array, " r ..."]) -> Float[Array, " count ..."]:
        """Return the sum over the rows of each member."""
        blocks = rows.reshape(len(self.index), -1, *rows.shape[1:]).sum(axis=1)
        return jax.ops.segment_sum(blocks, self.index, self.count)


class _Solution(NamedTuple):
    """The scores given the rows.

    Attributes:
        parts: blocks of rows with the inner products of [Z r] without the eliminated
            members: the rows less the members, the members in prior sds, their sum.
        factor: Cholesky factor of A.
        mean: of the scores.
        precision: of each eliminated member given the scores, or None.
    """

    parts: Sequence[Float[Array, "_ m1"]]
    factor: Float[Array, "m m"]
    mean: Float[Array, " m"]
    precision: Float[Array, " n"] | None


class Linear(eqx.Module):
    """A linear-Gaussian residual in noise sds; rows may be compressed.

    Attributes:
        residual: reading less its mean, shape (r,).
        design: Z, contribution of each score to the rows.
        log_scale: Σ log sd √(2π) over the measured rows.
        grouped: members to eliminate one by one, or None.
    """

    residual: Float[Array, " r"]
    design: Float[Array, "r m"]
    log_scale: Float[Array, ""]
    grouped: Grouped | None = None

    def _solved(self) -> _Solution:
        rows = jnp.column_stack([self.design, self.residual])
        parts, precision = [rows], None
        if self.grouped is not None:
            column = self.grouped.column[:, None]
            precision = 1.0 + self.grouped.sums(column[:, 0] ** 2)
            members = self.grouped.sums(column * rows) / precision[:, None]
            total = jnp.sum(members, axis=0, keepdims=True)
            total /= jnp.sqrt(jnp.sum(1.0 / precision))
            parts = [rows - column * self.grouped.to_rows(members), members, total]
        products = sum((part.T @ part for part in parts), start=jnp.zeros(()))
        size = self.design.shape[1]
        factor = jnp.linalg.cholesky(jnp.eye(size) + products[:-1, :-1])
        half = solve_triangular(factor, products[:-1, -1], lower=True)
        mean = solve_triangular(factor.T, half, lower=False)
        return _Solution(parts, factor, mean, precision)

    def log_likelihood(self) -> Float[Array, ""]:
        """Return log p(y) with scores and members integrated out."""
        parts, factor, mean, precision = self._solved()
        # A sum of squares: the difference r'r − u'A⁻¹u would lose its digits where
        # members spread much wider than the noise.
        left = [part @ jnp.append(-mean, 1.0) for part in parts]
        square = sum((rows @ rows for rows in left), start=mean @ mean)
        volume = 2.0 * jnp.sum(jnp.log(jnp.diag(factor)))
        if precision is not None:
            volume += jnp.sum(jnp.log(precision)) + jnp.log(jnp.mean(1.0 / precision))
        return -0.5 * (square + volume) - self.log_scale

    def scores(self) -> tuple[Float[Array, " m"], Float[Array, "m m"]]:
        """Return mean of the scores given y, and a root of their covariance."""
        _, factor, mean, _ = self._solved()
        return mean, solve_triangular(factor.T, jnp.eye(len(mean)), lower=False)

    def draw(
        self, key: Key[Array, ""]
    ) -> tuple[Float[Array, " m"], Float[Array, " n"] | None]:
        """Draw scores and members, in prior sds, from their distribution given y."""
        parts, factor, mean, precision = self._solved()
        of_scores, of_members = jax.random.split(key)
        noise = jax.random.normal(of_scores, mean.shape)
        scores = mean + solve_triangular(factor.T, noise, lower=False)
        if precision is None:
            return scores, None
        noise = jax.random.normal(of_members, precision.shape)
        free = parts[1] @ jnp.append(-scores, 1.0) + noise / jnp.sqrt(precision)
        excess = jnp.sum(free) / jnp.sum(1.0 / precision) / precision
        return scores, free - excess


def contrasts(count: int) -> Float[Array, "count k"]:
    """Return an orthonormal basis of deviations that sum to zero, [count, count−1]."""
    return jnp.asarray(helmert(count).T)
