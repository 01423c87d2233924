"""A bank of posterior draws, each with conjugate knowledge of what a stream can change.

Under draw i a reading is y = m_i + s_i (f − 1) + b + c_i·u + e with mean m_i, slope s_i
and columns c_i of the draw. Stiffness factor f, shift b of the zero and coefficients u
of a discrepancy and of untested conditions are normal given the noise
variance, which is inverse gamma: each row updates them exactly. A draw is weighted by
the density that it gave the rows.

Noise with a correlation ρ of neighbours is whitened (Cochrane and Orcutt, 1949): rows
become (y_t − ρ y_(t−1)) / √(1 − ρ²), their columns likewise.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array
from jax.scipy.special import logsumexp, ndtr, ndtri
from jaxtyping import Float, Int

from hdcal.tracking.change_alarm import step_sums

STIFFNESS, ZERO = 0, 1
# A correlation closer to one could not be distinguished from a shift of the zero.
_MOST_CORRELATION = 0.95
# Residuals beyond so many sds count as this in the estimate of ρ.
_FARTHEST = 4.0
# Errors of rounding that repeat with the force by more than this are no correlation.
_MOST_REPEATED = 0.1
# Forces in neighbouring cells, so many steps wide, share their error of rounding. They
# are counted in a table of fixed size, where each epoch has other cells.
CELL, CELLS, _EPOCH = 0.125, 2**12, 1531
# Turn of the unknowns of untested conditions, from this share of the noise on.
_TURN, _LEAST = 0.37, 0.1
# What is computed of a row.
FIELDS = (
    *("force", "force_scale", "freedom", "innovation", "score", "alarm"),
    *("correlation", "stiffness", "stiffness_scale", "draws"),
)


class RowForces(NamedTuple):
    """Readings that draws expect at rows [N]; the slope is by the relative stiffness.

    The excess is the variance of a reading beyond that of one without load [N²]; the
    extrapolation the sd of the error at untested conditions, with the sign of the side
    on which these lie; the columns are those of the coefficients of the discrepancy.
    """

    mean: Float[Array, "n draw"]
    slope: Float[Array, "n draw"]
    excess: Float[Array, "n draw"]
    extrapolation: Float[Array, "n draw"]
    columns: Float[Array, "n draw c"]


class Bank(eqx.Module):
    """Knowledge after some rows, and what is constant over a stream.

    The covariance of the coefficients is relative to the noise variance, which has a
    shape and a rate [N²]. Columns and reading are those of the row before, products the
    sums of products of neighbouring residuals and of squares. Counts are of the
    readings in each cell of the force [N]; each epoch has other cells. The stiffness is
    as read [N/mm], the variance that of a reading without load at first [N²], the step
    that of the force, 0 if not rounded, and remounting the variance of the zero from
    one mounting to the next [N²].
    """

    mean: Float[Array, "draw p"]
    covariance: Float[Array, "draw p p"]
    shape: Float[Array, ""]
    rate: Float[Array, " draw"]
    log_weight: Float[Array, " draw"]
    columns: Float[Array, "draw p"]
    reading: Float[Array, " draw"]
    products: Float[Array, " 2"]
    sums: Float[Array, " 2"]
    counts: Float[Array, " cell"]
    epoch: Int[Array, ""]
    stiffness: Float[Array, " draw"]
    variance: Float[Array, " draw"]
    step: Float[Array, ""]
    remounting: Float[Array, ""]
    threshold: Float[Array, ""]

    @property
    def noise(self):
        """Variance of a reading, its coefficients known, in each draw [N²]."""
        return self.rate / self.shape

    @property
    def correlation(self):
        """Estimate of ρ, one sd of chance larger: too small a one raises alarms."""
        product, power = self.products
        rho = product / power
        rho = rho + jnp.sqrt(jnp.maximum(1.0 - rho**2, 0.0) / power)
        return jnp.clip(rho, -_MOST_CORRELATION, _MOST_CORRELATION)

    @property
    def stiffness_now(self):
        """Mean and scale of the Student distribution of the stiffness [N/mm]."""
        scale = jnp.sqrt(self.noise * self.covariance[:, STIFFNESS, STIFFNESS])
        middle = self.mean[:, STIFFNESS]
        return self.mixed(self.stiffness * middle, self.stiffness * scale)

    def mixed(self, middle, scale):
        """Return mean and scale of a mixture over the draws."""
        weights = jnp.exp(self.log_weight)
        mean = weights @ middle
        return mean, jnp.sqrt(weights @ (scale**2 + (middle - mean) ** 2))

    def remounted(self, is_new) -> "Bank":
        """Return the bank before a row that may be the first of another mounting."""
        moved = jnp.where(is_new, self.remounting, 0.0) * (self.shape - 1.0) / self.rate
        covariance = self.covariance.at[:, ZERO, ZERO].add(moved)
        return replace(self, covariance=covariance, epoch=self.epoch + is_new)


@jax.jit
def follow_rows(bank: Bank, rows: dict[str, Any], count: int):
    """Take rows in their order; return the bank after them, and FIELDS of each row.

    Rows have the `force` as read [N], the `forces` that the draws expect, whether a row
    `follows` the one before, so that their noise may be correlated, and is `remounted`,
    and the `cell` of its force. Those after the count are padding.
    """

    def step(i, carry):
        bank, line = take_row(carry[0], jax.tree.map(lambda leaf: leaf[i], rows))
        return bank, carry[1].at[i].set(line)

    lines = jnp.zeros((len(rows["force"]), len(FIELDS)))
    return jax.lax.fori_loop(0, count, step, (bank, lines))


def take_row(bank: Bank, row: dict[str, Any]):
    """Return the bank after a row, and FIELDS as the rows before predicted them."""
    bank = bank.remounted(row["remounted"])
    forces, freedom = row["forces"], 2.0 * bank.shape
    # The row is scaled to the noise of a reading without load.
    noise = jnp.sqrt(1.0 + forces.excess / bank.variance)
    columns = forces.slope, jnp.ones_like(noise), *forces.columns.T
    columns = jnp.stack([*columns, *_unknowns(bank, forces)], axis=1) / noise[:, None]
    reading = (row["force"] - forces.mean + forces.slope) / noise
    rho = jnp.where(row["follows"], bank.correlation, 0.0)
    white = jnp.sqrt(1.0 - rho**2)
    own = (columns - rho * bank.columns) / white
    error = (reading - rho * bank.reading) / white - jnp.vecdot(own, bank.mean)
    gain = jnp.einsum("dpq,dq->dp", bank.covariance, own)
    wide = jnp.vecdot(gain, own)
    spread = jnp.sqrt(bank.noise * (1.0 + wide))
    innovation = _normal_score(bank, error / spread, freedom)
    scale = noise * white
    force = bank.mixed(row["force"] - scale * error, scale * spread)
    weight, repeated, counts = _rounding_weight(bank, row["cell"])
    density = -(0.5 + bank.shape) * jnp.log1p((error / spread) ** 2 / freedom)
    log_weight = bank.log_weight + weight * (density - jnp.log(spread))
    share = weight / (1.0 + weight * wide)
    taken = (share[:, None] * gain)[:, :, None] * gain[:, None, :]
    after = replace(
        bank,
        mean=bank.mean + (share * error)[:, None] * gain,
        covariance=bank.covariance - taken,
        shape=bank.shape + 0.5 * weight,
        rate=bank.rate + 0.5 * share * error**2,
        log_weight=log_weight - logsumexp(log_weight),
        columns=columns,
        reading=reading,
        counts=counts,
    )
    learns = row["follows"] & (repeated < _MOST_REPEATED)
    products = bank.products + jnp.where(learns, _products(bank, after), 0.0)
    sums, score, alarm = step_sums(bank.sums, innovation, bank.threshold)
    after = replace(after, products=products, sums=sums)
    draws = jnp.exp(-logsumexp(2.0 * after.log_weight))
    line = *force, freedom, innovation, score, alarm, rho, *after.stiffness_now, draws
    return after, jnp.stack([jnp.asarray(each, float) for each in line])


def _unknowns(bank: Bank, forces: RowForces):
    """Return columns of the two unknowns that rows at untested conditions share.

    Their mix turns with the logarithm of the error: errors of which one is 2, 5 and 30
    times the other correlate by .97, .83 and .31, as with bends that grow.
    """
    size = forces.extrapolation
    floor = jnp.sqrt(bank.variance) * _LEAST
    angle = _TURN * jnp.log(jnp.maximum(jnp.abs(size) / floor, 1.0))
    return size * jnp.cos(angle), size * jnp.sin(angle)


def _normal_score(bank: Bank, t, freedom):
    """Return the normal score of a reading in a mixture of Student distributions.

    By Wallace (Annals of Mathematical Statistics 30, 1959), to 0.02 from some three
    degrees of freedom on.
    """
    z = jnp.sqrt(freedom * jnp.log1p(t**2 / freedom))
    z = jnp.sign(t) * z * (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0)
    below, above = jnp.exp(bank.log_weight) @ ndtr(jnp.stack([z, -z], axis=1))
    # The smaller tail still has its digits.
    tail = jnp.maximum(jnp.minimum(below, above), 1e-300)
    return jnp.where(below < above, ndtri(tail), -ndtri(tail))


def _products(before: Bank, after: Bank):
    """Return what the residuals of a row and of the one before add to the sums."""
    last, this = (
        (bank.reading - jnp.vecdot(bank.columns, after.mean)) / jnp.sqrt(after.noise)
        for bank in (before, after)
    )
    last, this = (jnp.clip(each, -_FARTHEST, _FARTHEST) for each in (last, this))
    pair = jnp.stack([this * last, (this**2 + last**2) / 2.0])
    return pair @ jnp.exp(after.log_weight)


def _rounding_weight(bank: Bank, cell):
    """Return the weight of a coarsely rounded reading, its repeated share, the counts.

    With noise of sd σ below half of the step q an error of rounding repeats with the
    force, with variance b² = q²/12 exp(−4π² σ²/q²) (first harmonic of the error). Then
    k readings of a force are worth one of variance b² + s²/k, where b² + s² is the
    variance of a reading.
    """
    if bank.counts.size == 0:
        return jnp.ones(()), jnp.zeros(()), bank.counts
    variance, square = jnp.exp(bank.log_weight) @ bank.noise, bank.step**2
    noise = jnp.maximum(variance - square / 12.0, 0.0)
    part = square / 12.0 * jnp.exp(-4.0 * jnp.pi**2 * noise / square) / variance
    part = jnp.minimum(part, 1.0)
    near = (cell + _EPOCH * bank.epoch + jnp.arange(-1, 2)) % CELLS
    before = bank.counts[near].sum()
    after = (before + 1.0) / (before * part + 1.0)
    known = before / jnp.where(before > 0.0, before * part + 1.0 - part, 1.0)
    return after - known, part, bank.counts.at[near[1]].add(1.0)
