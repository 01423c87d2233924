"""Contributions of effects to the mean reading, at many values of their parameters."""

from dataclasses import replace

import jax
import numpy as np

from hdcal.data.records import Records
from hdcal.exported import jit
from hdcal.inference.force_model.padding import pad_records, repeat_last_row
from hdcal.physics.chain import Base, Reading, predict_reading
from hdcal.physics.effect import Effect

# Points predicted at a time, always as many: one executable serves all grids. With
# many rows fewer, 2**22 numbers of eight bytes being 32 MB.
_BLOCK, _MOST_VALUES = 64, 2**22


def padded_records(records: Records) -> Records:
    """Return records of a length that many cases share.

    `known` is left out: everything would be compiled anew for it, and only the `needs`
    of effects depend on it.
    """
    return pad_records(replace(records, known=frozenset()))


@jit
def _curves(effects: Effect, base: Base, records: Records, reading: Reading):
    plain, _ = predict_reading(base, (), records, reading)

    def one(effect):
        return predict_reading(base, (effect,), records, reading)[0] - plain

    return jax.vmap(one)(effects)


def effect_curves(
    effect: type[Effect],
    values: dict[str, np.ndarray],
    base: Base,
    padded: Records,
    reading: Reading,
) -> np.ndarray:
    """Return the effect's contribution to the mean reading [N].

    Args:
        effect: the effect.
        values: of every parameter, each of shape (g,).
        base: the force model about which it acts.
        padded: the rows, from `padded_records`.
        reading: how the rig reads.

    Returns:
        Shape (g, n), of all padded rows.
    """
    block = int(np.clip(_MOST_VALUES // len(padded.force), 1, _BLOCK))
    table = {name: np.asarray(column, float) for name, column in values.items()}
    count = len(next(iter(table.values())))
    table = repeat_last_row(table, count + -count % block)
    parts = []
    for start in range(0, count, block):
        some = {name: column[start : start + block] for name, column in table.items()}
        parts.append(np.asarray(_curves(effect(**some), base, padded, reading)))
    return np.concatenate(parts)[:count]
