"""What readings say of gears: sums, whatever the number of rows."""

from dataclasses import replace
from typing import TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from hdcal.data.records import Array

# Share of squares that rounding alone leaves.
_NOTHING = 1e-12


class MountingSums(eqx.Module):
    """What the readings of each mounting say, one entry each.

    Attributes:
        gear: index of its gear.
        rows: number of readings [-].
        x: mean deformation as read, at the modulus of its temperature [mm].
        y: mean force [N].
        xx: squares about the mean, summed [mm²].
        xy: products likewise [N mm].
        yy: squares likewise [N²].
        operator: index of who mounted it.
        rig: index of the rig that read it.
    """

    gear: Int[Array, " m"]
    rows: Float[Array, " m"]
    x: Float[Array, " m"]
    y: Float[Array, " m"]
    xx: Float[Array, " m"]
    xy: Float[Array, " m"]
    yy: Float[Array, " m"]
    operator: Int[Array, " m"]
    rig: Int[Array, " m"]


class GearSums(eqx.Module):
    """What the readings of each gear say, with mountings that are alike together.

    They have equally many rows, the same operator and the same rig: whatever the law of
    their zeros, these have one and the same.

    Attributes:
        mountings: how many have so many rows; 0 where a gear has no more kinds.
        rows: readings in each of them.
        x: their mean deformations, summed [mm].
        y: mean forces likewise [N].
        xx: squares of the means likewise [mm²].
        xy: products likewise [N mm].
        yy: squares likewise [N²].
        own_xx: squares about each mounting's mean, summed [mm²].
        own_xy: products likewise [N mm].
        own_yy: squares likewise [N²].
        noise_free: degrees of freedom that a gear's own line on each rig leaves;
            [gear].
        log_noise_sd: log of the noise sd beside it [N]; 0 where nothing tells it.
        operator: index of who mounted them; [gear, kind].
        rig: index of the rig that read them; [gear, kind].
        lot: index of its lot; [gear].
    """

    mountings: Float[Array, "g s"]
    rows: Float[Array, "g s"]
    x: Float[Array, "g s"]
    y: Float[Array, "g s"]
    xx: Float[Array, "g s"]
    xy: Float[Array, "g s"]
    yy: Float[Array, "g s"]
    own_xx: Float[Array, "g s"]
    own_xy: Float[Array, "g s"]
    own_yy: Float[Array, "g s"]
    noise_free: Float[Array, " g"]
    log_noise_sd: Float[Array, " g"]
    operator: Int[Array, "g s"]
    rig: Int[Array, "g s"]
    lot: Int[Array, " g"]


# Sums that hold the deformation, and its power in them.
_POWERS = {"x": 1, "xx": 2, "xy": 1, "own_xx": 2, "own_xy": 1}
Sums = TypeVar("Sums", MountingSums, GearSums)


def stretched(sums: Sums, factor) -> Sums:
    """Return sums as if deformations were longer by a factor.

    So counts whatever makes a mounting read stiffer than its gear is.

    Args:
        sums: of mountings, or of gears.
        factor: of each mounting, or of each gear and kind.
    """
    held = {name: power for name, power in _POWERS.items() if hasattr(sums, name)}
    longer = {name: getattr(sums, name) * factor**p for name, p in held.items()}
    return replace(sums, **longer)


def gear_sums(each: MountingSums, lot: np.ndarray, step: float = 0.0) -> GearSums:
    """Return the sums of gears from those of their mountings.

    Args:
        each: mounting.
        lot: index of each gear's lot, shape (g,).
        step: of the force display [N]: a few readings that it shows on a line by
            chance scatter nevertheless, by its rounding.
    """
    alike = [each.gear, each.rows, each.operator, each.rig]
    kinds, kind = np.unique(alike, axis=1, return_inverse=True)
    gear = kinds[0].astype(int)
    # Kinds are in the order of their gears: place within its own.
    slot = np.arange(len(gear)) - np.searchsorted(gear, gear)
    shape = len(lot), int(slot.max(initial=0)) + 1

    def summed(values) -> np.ndarray:
        table = np.zeros(shape)
        table[gear, slot] = np.bincount(kind.ravel(), values, len(gear))
        return table

    rows = np.ones(shape)
    rows[gear, slot] = kinds[1]
    operator, rig = np.zeros((2, *shape), int)
    operator[gear, slot], rig[gear, slot] = kinds[2:]
    x, y = each.x, each.y
    count = summed(np.ones_like(x))
    own = [summed(values) for values in (each.xx, each.xy, each.yy)]
    free, log_sd = _noise(count, rows, own, rig, step)
    return GearSums(
        mountings=count,
        rows=rows,
        x=summed(x),
        y=summed(y),
        xx=summed(x * x),
        xy=summed(x * y),
        yy=summed(y * y),
        own_xx=own[0],
        own_xy=own[1],
        own_yy=own[2],
        noise_free=free,
        log_noise_sd=log_sd,
        operator=operator,
        rig=rig,
        lot=lot,
    )


def _noise(count: np.ndarray, rows: np.ndarray, own, rig: np.ndarray, step: float):
    """Return degrees of freedom and log sd beside each gear's own line on each rig.

    An exact line gets the squares that the display's rounding leaves in the mean.
    """
    yy = own[2].sum(axis=1)
    free, square = np.sum(count * (rows - 1.0), axis=1), yy.copy()
    for one in range(int(rig.max()) + 1):
        here = (rig == one) & (count > 0.0)
        xx, xy = (np.sum(values * here, axis=1) for values in own[:2])
        square -= xy**2 / np.where(xx > 0.0, xx, 1.0)
        # Single readings on a rig take no slope.
        free -= xx > 0.0
    exact = (free > 0.0) & (square <= _NOTHING * yy)
    added = np.where(exact, free * step**2 / 12.0, 0.0)
    own[2][:, 0] += added
    square += added
    return tuple(np.asarray(part) for part in _told(free, square, yy))


def line_noise(sums: GearSums):
    """Return degrees of freedom and log sd beside one line of each gear, both [gear].

    As `GearSums` has them of a line on each rig.
    """
    count, rows, yy = sums.mountings, sums.rows, jnp.sum(sums.own_yy, axis=1)
    xx, xy = (jnp.sum(values, axis=1) for values in (sums.own_xx, sums.own_xy))
    square = yy - xy**2 / jnp.where(xx > 0.0, xx, 1.0)
    return _told(jnp.sum(count * (rows - 1.0), axis=1) - 1.0, square, yy)


def _told(free, square, yy):
    """Return degrees of freedom and log sd, noughts where squares tell none."""
    told = (free > 0.0) & (square > _NOTHING * yy)
    free = jnp.where(told, free, 0.0)
    ratio = jnp.where(told, square, 1.0) / jnp.where(told, free, 1.0)
    return free, 0.5 * jnp.log(ratio)
