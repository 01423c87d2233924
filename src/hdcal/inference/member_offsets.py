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
        index = jnp.repeat(self.index, self._block)
        return self.column[:, None] * contrasts(self.count)[index]

    def sums(self, rows: Float[Array, " r ..."]) -> Float[Array, " count ..."]:
        """Return the sum over the rows of each member."""
        blocks = rows.reshape(len(self.index), self._block, *rows.shape[1:]).sum(axis=1)
        return jax.ops.segment_sum(blocks, self.index, self.count)


class _Eliminated(eqx.Module):
    """What members leave to the other weights; all in prior sds of the members.

    Attributes:
        precision: of each member when the other weights are known.
        pull: of the readings on each member.
        shared: information that each member shares with each other weight.
    """

    precision: Float[Array, " n"]
    pull: Float[Array, " n"]
    shared: Float[Array, "n m"]

    @property
    def variance(self) -> Float[Array, ""]:
        """Variance of the members' sum when the other weights are known."""
        return jnp.sum(1.0 / self.precision)

    def mean(self, weights: Float[Array, " m"]) -> Float[Array, " n"]:
        """Return the mean of the members given the other weights, sum ignored."""
        return (self.pull - self.shared @ weights) / self.precision


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

    def _eliminated(self, design, residual) -> _Eliminated | None:
        if self.grouped is None:
            return None
        column = self.grouped.column * self.grouped.sd / self.sd
        return _Eliminated(
            1.0 + self.grouped.sums(column**2),
            self.grouped.sums(column * residual),
            self.grouped.sums(column[:, None] * design),
        )

    def _factor(self):
        """Return the weights' factor and half solution, and what they do not enter."""
        design = self.design * self.scale / self.sd[:, None]
        residual = self.residual / self.sd
        precision = jnp.eye(len(self.scale)) + design.T @ design
        pull, rest = design.T @ residual, jnp.sum(residual**2)
        members = self._eliminated(design, residual)
        if members is not None:
            share = members.shared.T / members.precision
            total, slope = jnp.sum(members.mean(jnp.zeros(len(pull)))), share.sum(1)
            variance = members.variance
            precision += jnp.outer(slope, slope) / variance - share @ members.shared
            pull += slope * total / variance - share @ members.pull
            rest += total**2 / variance - jnp.sum(members.pull**2 / members.precision)
            rest += jnp.sum(jnp.log(members.precision))
            rest += jnp.log(variance / len(members.precision))
        factor = jnp.linalg.cholesky(precision)
        half = solve_triangular(factor, pull, lower=True)
        return factor, half, rest, members

    def log_likelihood(self) -> Float[Array, ""]:
        """Return log p(y) with weights and members integrated out."""
        factor, half, rest, _ = self._factor()
        return -(
            0.5 * (rest - jnp.sum(half**2))
            + jnp.sum(jnp.log(jnp.diag(factor)))
            + self.log_volume
            + 0.5 * self.count * jnp.log(2.0 * jnp.pi)
        )

    def draw(
        self, key: Key[Array, ""]
    ) -> tuple[Float[Array, " m"], Float[Array, " n"] | None]:
        """Draw weights and members from their distribution given y."""
        factor, half, _, members = self._factor()
        of_weights, of_members = jax.random.split(key)
        noise = jax.random.normal(of_weights, half.shape)
        weights = solve_triangular(factor.T, half + noise, lower=False)
        if self.grouped is None or members is None:
            return self.scale * weights, None
        noise = jax.random.normal(of_members, members.pull.shape)
        free = members.mean(weights) + noise / jnp.sqrt(members.precision)
        excess = jnp.sum(free) / members.variance / members.precision
        return self.scale * weights, self.grouped.sd * (free - excess)


def contrasts(count: int) -> Float[Array, "count k"]:
    """Return an orthonormal basis of deviations that sum to zero, [count, count−1].

    Deviations from the mean of the tested members: their common part is already
    the population's centre.
    """
    return jnp.asarray(helmert(count).T)
