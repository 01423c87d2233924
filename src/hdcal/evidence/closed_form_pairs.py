"""Evidence of two effects at once in closed form: a bivariate normal in a box."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.priors import Prior
from hdcal.data.records import Array
from hdcal.evidence.closed_form import LOG_2PI, TINY, over_noise, settle
from hdcal.inference.likelihood import log_interval


class Couples(eqx.Module):
    """Pairs of lines, one entry for each; inner products after projection.

    Attributes:
        ee: squared length of the reading less both offsets.
        eu: products with both slopes, [2, m].
        uu: Gram entries (11, 12, 22) of the slopes, [3, m].
        low: lower ends of the amplitudes, [2, m].
        high: upper ends, [2, m].
        mean: of the priors, [2, m].
        precision: of the priors, [2, m].
        log_height: sum of both.
    """

    ee: Float[Array, " m"]
    eu: Float[Array, "2 m"]
    uu: Float[Array, "3 m"]
    low: Float[Array, "2 m"]
    high: Float[Array, "2 m"]
    mean: Float[Array, "2 m"]
    precision: Float[Array, "2 m"]
    log_height: Float[Array, " m"]


def _log_box(couples: Couples, mean, cov11, cov12, cov22):
    """Return log P(box) of a bivariate normal, the second given the first's moments."""
    sd1 = jnp.sqrt(cov11)
    low, high = (couples.low[0] - mean[0]) / sd1, (couples.high[0] - mean[0]) / sd1
    first = log_interval(low, high)
    # Moments of the cut normal, from its density at both ends.
    ends = jnp.stack([low, high])
    density = jnp.exp(-0.5 * ends**2 - 0.5 * LOG_2PI - first)
    shift = density[0] - density[1]
    finite = jnp.where(jnp.abs(ends) < 30.0, ends, 0.0)
    spread = 1.0 + finite[0] * density[0] - finite[1] * density[1] - shift**2
    shift = jnp.clip(shift, jnp.minimum(low, high), jnp.maximum(low, high))
    spread = jnp.clip(spread, 1e-6, 1.0)
    slope = cov12 / sd1
    centre = mean[1] + slope * shift
    sd2 = jnp.sqrt(jnp.maximum(cov22 - slope**2 * (1.0 - spread), 1e-12 * cov22))
    second = log_interval(
        (couples.low[1] - centre) / sd2, (couples.high[1] - centre) / sd2
    )
    return first + second


@jax.jit
def couple_evidence(constant, rows, couples: Couples, sigma: Prior):
    """Return the log evidence of pairs of effects.

    Args:
        constant: log of the determinants of whitening and base model.
        rows: number of rows.
        couples: inner products and cells.
        sigma: prior of the noise sd.
    """

    def solve(log_sd):
        variance = jnp.exp(2.0 * log_sd)
        p11 = couples.uu[0] / variance + couples.precision[0] + TINY
        p12 = couples.uu[1] / variance
        p22 = couples.uu[2] / variance + couples.precision[1] + TINY
        drawn = couples.eu / variance + couples.precision * couples.mean
        det = jnp.maximum(p11 * p22 - p12**2, 1e-12 * p11 * p22)
        cov11, cov12, cov22 = p22 / det, -p12 / det, p11 / det
        mean = jnp.stack(
            [
                cov11 * drawn[0] + cov12 * drawn[1],
                cov12 * drawn[0] + cov22 * drawn[1],
            ]
        )
        return det, drawn, mean, (cov11, cov12, cov22)

    def step(log_sd):
        mean = jnp.clip(solve(log_sd)[2], couples.low, couples.high)
        left = (
            couples.ee
            - 2.0 * jnp.sum(mean * couples.eu, axis=0)
            + mean[0] ** 2 * couples.uu[0]
            + 2.0 * mean[0] * mean[1] * couples.uu[1]
            + mean[1] ** 2 * couples.uu[2]
        )
        return 0.5 * jnp.log(jnp.maximum(left, 1e-9 * couples.ee) / rows)

    log_sd = settle(step, 0.5 * jnp.log(couples.ee / rows))

    def value(at):
        det, drawn, mean, cov = solve(at)
        return (
            -rows * at
            - 0.5 * couples.ee * jnp.exp(-2.0 * at)
            + 0.5 * jnp.sum(drawn * mean, axis=0)
            - 0.5 * jnp.sum(couples.precision * couples.mean**2, axis=0)
            + LOG_2PI
            - 0.5 * jnp.log(det)
            + _log_box(couples, mean, *cov)
            + couples.log_height
        )

    total = over_noise(value, log_sd, rows, sigma)
    return total + constant - 0.5 * rows * LOG_2PI
