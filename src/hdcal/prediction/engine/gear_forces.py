"""The force on gears alone: a product has no rig, neither its zeros nor its drift."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.exported import jit
from hdcal.inference.gauges import acting, shown
from hdcal.inference.problem import Problem
from hdcal.inference.values import Values
from hdcal.prediction.engine.even_points import spread_evenly
from hdcal.prediction.engine.forces import force_of, grid_records
from hdcal.prediction.engine.pooled import Pooled
from hdcal.prediction.engine.untested import (
    SITES,
    Bends,
    Untested,
    untested_of,
)

# Sites of a draw: which of the causes it is of, and its modulus over that of the tested
# gear where another material was drawn.
CAUSE, MODULUS = "_cause", "_modulus"


def gear_values(
    pooled: Pooled, seed: int = 0, most: int | None = None
) -> tuple[Values, Untested]:
    """Return draws with what they leave open, and what that is for each cause.

    Args:
        pooled: draws of all causes.
        seed: of what the draws leave open.
        most: draws to keep, taken evenly; all by default.

    Returns:
        The draws; every leaf of what is untested has an axis of causes first.
    """
    causes, total = pooled.causes, len(pooled.index)
    kept = evenly(total, total if most is None else most)
    values = {name: draws[kept] for name, draws in pooled.values.items()}
    # Of what fills a space evenly, a part that was picked from it need not.
    levels, index = spread_evenly(len(kept), SITES, seed), pooled.index[kept]
    each = [untested_of(cause, levels[index == i]) for i, cause in enumerate(causes)]
    found: dict[str, np.ndarray] = {CAUSE: index}
    for name, first in each[0][1].items():
        found[name] = np.empty((len(index), *first.shape[1:]))
        for i, (_, sites) in enumerate(each):
            found[name][index == i] = sites[name]
    parts = [untested for untested, _ in each]
    stacked = jax.tree.map(lambda *leaves: np.stack(leaves), *parts)
    return {**values, **found}, stacked


def evenly(total: int, count: int) -> np.ndarray:
    """Return the rows of so many draws, taken evenly from all chains."""
    return np.linspace(0, total - 1, min(count, total)).astype(int)


@jit
def gear_forces(
    problem: Problem,
    values: Values,
    deformation: Float[Array, " n"],
    temperature: Float[Array, " n"],
    factor: Float[Array, "..."] | float = 1.0,
    untested: Untested | None = None,
) -> Float[Array, "n draw"]:
    """Compute the force of every draw on gears at a deformation of their own.

    ω is what the gear sees, counted from its free shape. Left are the force model,
    effects on the force, where it was fitted the leftover discrepancy, and beyond the
    tested deformation the bend that may grow there. Temperatures beyond the tested ones
    change the modulus only: a product has no rig that drifts. Each row is another gear,
    loaded from rest in one go.

    Args:
        problem: structure.
        values: draws by site: [draw, …].
        deformation: radial ω, of either sign [mm].
        temperature: of the gear [°C].
        factor: stiffness relative to the tested gear's [-], broadcast to [draw, n];
            the leftover discrepancy is taken to grow with it.
        untested: from `gear_values`; None where no gear was tested.

    Returns:
        Force [N].
    """
    count = len(deformation)
    as_read = deformation / problem.reading.radial_per_read
    pressed = jnp.where(as_read < 0.0, -1.0, 1.0)
    records = grid_records(as_read, temperature, pressed, 0.0)

    def of_draw(value, own):
        force, _ = force_of(problem, value, records, factor=own, quantity="gear")
        if untested is None:
            return force
        bends = gear_bends(untested, value)
        left = gear_leftover(problem, value, bends, as_read, pressed)
        return force + own * value.get(MODULUS, 1.0) * left

    factor = jnp.broadcast_to(jnp.asarray(factor), (len(values["K"]), count))
    return jax.vmap(of_draw, out_axes=1)(values, factor)


def gear_bends(untested: Untested, value: Values) -> Bends:
    """Return what may bend the force of one draw, by its own cause."""
    return jax.tree.map(lambda leaf: leaf[value[CAUSE]], untested).bends(value)


def gear_leftover(
    problem: Problem,
    value: Values,
    bends: Bends,
    as_read: Float[Array, " n"],
    movement: Float[Array, " n"],
) -> Float[Array, " n"]:
    """Return what the fitted leftover and the bend of a draw add to the force [N].

    The free shape is known, without force: between it and the nearer end of the tested
    range no bend grows.

    Args:
        problem: structure.
        value: one draw.
        bends: of the same draw, from `gear_bends`.
        as_read: deformation from the free shape, per mm as read.
        movement: +1 where it rises, −1 where it falls, 0 for the mean of both.
    """
    place = shown(value, as_read, 0.0)[0] + value["deformation_offset"]
    pressed = jnp.where(as_read < 0.0, -1.0, 1.0)
    low, high = bends.above.growth.far, bends.above.growth.end
    known = jnp.clip(place, jnp.minimum(low, 0.0), jnp.maximum(high, 0.0))
    beyond = jnp.clip(place, low, high) + (place - known)
    left, _ = bends.leftover(problem, value, beyond, pressed, movement)
    if problem.discrepancy is not None:
        left = left + bends.leftover(problem, value, place, pressed, movement)[1]
    return acting(value, left)
