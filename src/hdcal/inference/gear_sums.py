"""What readings say of gears: sums, whatever the number of rows."""

import equinox as eqx
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
    """

    gear: Int[Array, " m"]
    rows: Float[Array, " m"]
    x: Float[Array, " m"]
    y: Float[Array, " m"]
    xx: Float[Array, " m"]
    xy: Float[Array, " m"]
    yy: Float[Array, " m"]
    operator: Int[Array, " m"]


class GearSums(eqx.Module):
    """What the readings of each gear say, with mountings that are alike together.

    They have equally many rows and the same operator: whatever the law of their zeros,
    these have one and the same.

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
        noise_free: degrees of freedom that a gear's own line leaves; [gear].
        log_noise_sd: log of the noise sd beside it [N]; 0 where nothing tells it.
        operator: index of who mounted them; [gear, kind].
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
    lot: Int[Array, " g"]


def gear_sums(each: MountingSums, lot: np.ndarray, step: float = 0.0) -> GearSums:
    """Return the sums of gears from those of their mountings.

    Args:
        each: mounting.
        lot: index of each gear's lot, shape (g,).
        step: of the force display [N]: a few readings that it shows on a line by
            chance scatter nevertheless, by its rounding.
    """
    alike = [each.gear, each.rows, each.operator]
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
    operator = np.zeros(shape, int)
    operator[gear, slot] = kinds[2]
    x, y = each.x, each.y
    count = summed(np.ones_like(x))
    own = [summed(values) for values in (each.xx, each.xy, each.yy)]
    free, log_sd = _noise(count, rows, own, step)
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
        lot=lot,
    )


def _noise(count: np.ndarray, rows: np.ndarray, own, step: float):
    """Return degrees of freedom and log sd beside each gear's own line.

    An exact line gets the squares that the display's rounding leaves in the mean.
    """
    xx, xy, yy = (values.sum(axis=1) for values in own)
    free = np.sum(count * (rows - 1.0), axis=1) - 1.0
    square = yy - xy**2 / np.where(xx > 0.0, xx, 1.0)
    exact = (free > 0.0) & (square <= _NOTHING * yy)
    added = np.where(exact, free * step**2 / 12.0, 0.0)
    own[2][:, 0] += added
    square += added
    told = (free > 0.0) & (square > _NOTHING * yy)
    free = np.where(told, free, 0.0)
    ratio = np.where(told, square, 1.0) / np.where(told, free, 1.0)
    return free, 0.5 * np.log(ratio)
