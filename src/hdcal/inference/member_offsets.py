"""What belongs to a run, a specimen or the discrepancy, integrated out exactly.

Given the shared parameters these weights are normal a priori and enter a Gaussian
likelihood linearly, r ~ N(Z w, V) with w ~ N(0, S). Sampling them beside their own
scale makes funnels in which a sampler can be wrong without a warning; integrating
them out leaves nothing to go wrong:

    log p(r) = −½ [log|V| + log|A| + r'V⁻¹r − u'A⁻¹u],
    A = I + S^½ Z'V⁻¹Z S^½,  u = S^½ Z'V⁻¹r,   w = S^½ A⁻¹u + S^½ A^(−½) ξ.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.scipy.linalg import solve_triangular
from jaxtyping import Float, Key
from scipy.linalg import helmert

from hdcal.data.records import Array


class Linear(eqx.Module):
    """A linear-Gaussian residual; rows may be compressed ones.

    Attributes:
        residual: y − X c [N].
        design: Z, contribution of each weight to the rows [N per weight].
        sd: noise sd of the rows, √V [N].
        scale: prior sd of the weights, √S.
        log_volume: Σ log sd over the *original* rows, for compressed ones.
        count: number of original rows [-].
    """

    residual: Float[Array, " r"]
    design: Float[Array, "r m"]
    sd: Float[Array, " r"]
    scale: Float[Array, " m"]
    log_volume: Float[Array, ""]
    count: Float[Array, ""] | int

    def _factor(self):
        design = self.design * self.scale / self.sd[:, None]
        residual = self.residual / self.sd
        factor = jnp.linalg.cholesky(jnp.eye(len(self.scale)) + design.T @ design)
        half = solve_triangular(factor, design.T @ residual, lower=True)
        return factor, half, residual

    def log_likelihood(self) -> Float[Array, ""]:
        """Return log p(y) with the weights integrated out."""
        factor, half, residual = self._factor()
        return -(
            0.5 * (jnp.sum(residual**2) - jnp.sum(half**2))
            + jnp.sum(jnp.log(jnp.diag(factor)))
            + self.log_volume
            + 0.5 * self.count * jnp.log(2.0 * jnp.pi)
        )

    def draw(self, key: Key[Array, ""]) -> Float[Array, " m"]:
        """Draw the weights from their distribution given y."""
        factor, half, _ = self._factor()
        noise = jax.random.normal(key, half.shape)
        return self.scale * solve_triangular(factor.T, half + noise, lower=False)


def contrasts(count: int) -> Float[Array, "count k"]:
    """Return an orthonormal basis of deviations that sum to zero, [count, count−1].

    Deviations from the mean of the tested members: their common part is already
    the population's centre.
    """
    return jnp.asarray(helmert(count).T)
