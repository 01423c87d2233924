"""What belongs to a run, a specimen or the discrepancy, integrated out exactly.

Given the shared parameters these weights are normal a priori and enter a Gaussian
likelihood linearly, r ~ N(Z w, V) with w ~ N(0, S). Sampling them beside their own
scale makes funnels in which a sampler can be wrong without a warning; integrating
them out leaves nothing to go wrong:

    log p(r) = −½ [log|V| + log|A| + r'V⁻¹r − u'A⁻¹u],
    A = I + S^½ Z'V⁻¹Z S^½,  u = S^½ Z'V⁻¹r,   w = S^½ A⁻¹u + S^½ A^(−½) ξ.

Of members by the thousand each row has one, so that their block of A is diagonal:
they are eliminated one by one, at a cost that grows with their number, not its cube.
That they sum to zero is one observation more, of zero and without noise.
"""

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
        column: contribution of its member to each row [N per unit].
        sd: prior sd of a member on its own.
        count: number of members [-].
    """

    index: Int[Array, " b"]
    column: Float[Array, " r"]
    sd: Float[Array, ""]
    count: int = eqx.field(static=True)

    @property
    def _block(self) -> int:
        return len(self.column) // len(self.index)

    def columns(self) -> Float[Array, "r k"]:
        """Return the contribution of each contrast between the members to each row."""
        return self.column[:, None] * self.to_rows(contrasts(self.count))

    def to_rows(self, members: Float[Array, " count ..."]) -> Float[Array, " r ..."]:
        """Return the value of its member for each row."""
        return jnp.repeat(members[self.index], self._block, axis=0)

    def sums(self, rows: Float[Array, " r ..."]) -> Float[Array, " count ..."]:
        """Return the sum over the rows of each member."""
        blocks = rows.reshape(len(self.index), self._block, *rows.shape[1:]).sum(axis=1)
        return jax.ops.segment_sum(blocks, self.index, self.count)


class _Remainder(eqx.Module):
    """What is left of design and residual, its last column, without the members.

    Attributes:
        parts: rows whose inner products are those of readings without members: the
            rows less what their members explain; the members that explain it, in
            their prior sds; and the sum of these, which has to be zero.
        precision: of each member when the weights are known.
    """

    parts: list[Float[Array, "_ m1"]]
    precision: Float[Array, " n"] | None = None

    @property
    def products(self) -> Float[Array, "m1 m1"]:
        """Inner products of the columns."""
        return sum((part.T @ part for part in self.parts), start=jnp.zeros(()))

    def distance(self, weights: Float[Array, " m"]) -> Float[Array, ""]:
        """Return the squared distance of the residual from what the weights explain.

        A sum of squares: the difference of two would lose its digits where members
        or weights spread much wider than the noise.
        """
        left = (part @ jnp.append(-weights, 1.0) for part in self.parts)
        return sum((jnp.sum(rows**2) for rows in left), start=jnp.zeros(()))


class Linear(eqx.Module):
    """A linear-Gaussian residual; rows may be compressed ones.

    Attributes:
        residual: y − X c [N].
        design: Z, contribution of each weight to the rows [N per weight].
        sd: noise sd of the rows, √V [N].
        scale: prior sd of the weights, √S.
        log_volume: Σ log sd over the *original* rows, for compressed ones.
        count: number of original rows [-].
        grouped: members besides the weights, or None.
    """

    residual: Float[Array, " r"]
    design: Float[Array, "r m"]
    sd: Float[Array, " r"]
    scale: Float[Array, " m"]
    log_volume: Float[Array, ""]
    count: Float[Array, ""] | int

    grouped: Grouped | None = None

    def _remainder(self) -> _Remainder:
        design = self.design * self.scale / self.sd[:, None]
        rows = jnp.column_stack([design, self.residual / self.sd])
        if self.grouped is None:
            return _Remainder([rows])
        column = (self.grouped.column * self.grouped.sd / self.sd)[:, None]
        precision = 1.0 + self.grouped.sums(column[:, 0] ** 2)
        members = self.grouped.sums(column * rows) / precision[:, None]
        left = rows - column * self.grouped.to_rows(members)
        total = jnp.sum(members, axis=0, keepdims=True)
        total /= jnp.sqrt(jnp.sum(1.0 / precision))
        return _Remainder([left, members, total], precision)

    def _solved(self):
        """Return the remainder, the weights' factor and their mean."""
        remainder = self._remainder()
        products = remainder.products
        factor = jnp.linalg.cholesky(jnp.eye(len(self.scale)) + products[:-1, :-1])
        half = solve_triangular(factor, products[:-1, -1], lower=True)
        return remainder, factor, solve_triangular(factor.T, half, lower=False)

    def log_likelihood(self) -> Float[Array, ""]:
        """Return log p(y) with weights and members integrated out."""
        remainder, factor, weights = self._solved()
        volume = 2.0 * jnp.sum(jnp.log(jnp.diag(factor)))
        if (precision := remainder.precision) is not None:
            volume += jnp.sum(jnp.log(precision)) + jnp.log(jnp.mean(1.0 / precision))
        return -(
            0.5 * (remainder.distance(weights) + jnp.sum(weights**2) + volume)
            + self.log_volume
            + 0.5 * self.count * jnp.log(2.0 * jnp.pi)
        )

    def law(self) -> tuple[Float[Array, " m"], Float[Array, "m m"]]:
        """Return mean of the weights given y, and a root of their covariance."""
        _, factor, mean = self._solved()
        root = solve_triangular(factor.T, jnp.eye(len(mean)), lower=False)
        return self.scale * mean, self.scale[:, None] * root

    def draw(
        self, key: Key[Array, ""]
    ) -> tuple[Float[Array, " m"], Float[Array, " n"] | None]:
        """Draw weights and members from their distribution given y."""
        remainder, factor, mean = self._solved()
        of_weights, of_members = jax.random.split(key)
        noise = jax.random.normal(of_weights, mean.shape)
        weights = mean + solve_triangular(factor.T, noise, lower=False)
        precision = remainder.precision
        if self.grouped is None or precision is None:
            return self.scale * weights, None
        noise = jax.random.normal(of_members, precision.shape)
        free = remainder.parts[1] @ jnp.append(-weights, 1.0)
        free += noise / jnp.sqrt(precision)
        excess = jnp.sum(free) / jnp.sum(1.0 / precision) / precision
        return self.scale * weights, self.grouped.sd * (free - excess)


def contrasts(count: int) -> Float[Array, "count k"]:
    """Return an orthonormal basis of deviations that sum to zero, [count, count−1].

    Deviations from the mean of the tested members: their common part is already
    the population's centre.
    """
    return jnp.asarray(helmert(count).T)
