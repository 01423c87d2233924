"""Recurrences over ordered rows, shared by the effects that remember."""

import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float, Int

from hdcal.data.records import Array


def by_label(label: Int[Array, " n"]) -> tuple[Int[Array, " n"], Bool[Array, " n"]]:
    """Return the rows label after label, and which of those start a label.

    The file may take turns between runs or specimens; the order within each is kept.
    """
    order = jnp.argsort(label, stable=True)
    own = jnp.asarray(label)[order]
    return order, jnp.diff(own, prepend=own[:1] - 1) != 0


def fading(
    signal: Float[Array, " n"],
    time: Float[Array, " n"],
    run: Int[Array, " n"],
    rate: Float[Array, ""] | float,
) -> Float[Array, " n"]:
    """Return y with dy = d(signal) − rate · y dt, from zero at each run's reset.

    The signal is taken as linear in time between rows, for which the step is exact:
    y ← y e^(−λΔt) + Δs (1 − e^(−λΔt))/(λΔt). Before its first row a run has climbed
    from zero since the reset at t = 0. The rate λ is one over the time constant [1/s].
    """
    order, starts = by_label(run)
    time, signal = jnp.asarray(time)[order], jnp.asarray(signal)[order]
    step = jnp.where(starts, time, jnp.diff(time, prepend=0.0))
    gain = jnp.where(starts, signal, jnp.diff(signal, prepend=0.0))
    loss = rate * step
    # (1 − e^−x)/x, with its series where the quotient would be 0/0.
    small = jnp.abs(loss) < 1e-6
    safe = jnp.where(small, 1.0, loss)
    kept = jnp.where(small, 1.0 - 0.5 * loss, -jnp.expm1(-safe) / safe)
    decay = jnp.where(starts, 0.0, jnp.exp(-loss))

    def advance(last, row):
        now = row[0] * last + row[1]
        return now, now

    found = jax.lax.scan(advance, jnp.zeros(()), (decay, gain * kept))[1]
    return jnp.zeros_like(signal).at[order].set(found)


def play(
    deformation: Float[Array, " n"],
    label: Int[Array, " n"],
    half_width: Float[Array, " c"],
) -> Float[Array, "c n"]:
    """Return what follows a deformation with play: it moves only when pushed.

    y ← max(ω − r, min(ω + r, y)) for each half-width r [mm], from 0 in each run or
    specimen.
    """
    order, starts = by_label(label)

    def advance(last, row):
        pushed, anew = row
        last = jnp.where(anew, 0.0, last)
        now = jnp.maximum(pushed - half_width, jnp.minimum(pushed + half_width, last))
        return now, now

    rows = (jnp.asarray(deformation)[order], starts)
    found = jax.lax.scan(advance, jnp.zeros_like(half_width), rows)[1].T
    return jnp.zeros_like(found).at[:, order].set(found)


def stop_cells(
    deformation: Float[Array, " n"],
    label: Int[Array, " n"],
    reach: Float[Array, " c"],
) -> Float[Array, "c n"]:
    """Return z ← clip(z + Δω/reach, −1, 1) of each cell: it sticks, then slips.

    The rest of a play of this half-width, from rest at ω = 0 in each run or specimen.
    """
    return (deformation - play(deformation, label, reach)) / reach[:, None]


def load_cycle(
    sense: Float[Array, " n"], run: Int[Array, " n"], specimen: Int[Array, " n"]
) -> Float[Array, " n"]:
    """Return the number of the load cycle that each specimen is in, from 1.

    A cycle begins with each run, and within it wherever the movement turns back to the
    sense in which the run began. Rows count in the order of the file; a run belongs to
    one specimen.
    """
    order, starts = by_label(run)
    own = jnp.asarray(sense)[order]
    home = own[_group_start(starts)]
    begins = starts | ((jnp.diff(own, prepend=own[:1]) != 0.0) & (own == home))
    begins = jnp.zeros_like(begins).at[order].set(begins)

    order, starts = by_label(specimen)
    total = jnp.cumsum(begins[order].astype(float))
    number = total - total[_group_start(starts)] + 1.0
    return jnp.zeros_like(number).at[order].set(number)


def _group_start(starts: Bool[Array, " n"]) -> Int[Array, " n"]:
    """Return for each row the last one at or before it that starts a group."""
    return jax.lax.cummax(jnp.where(starts, jnp.arange(len(starts)), 0))
