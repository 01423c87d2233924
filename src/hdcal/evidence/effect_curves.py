"""What an effect adds to the mean reading, at many values of its parameters."""

from functools import partial

import jax
import numpy as np

from hdcal.data.records import Records
from hdcal.physics.chain import Base, Reading, predict_reading
from hdcal.physics.effect import Effect

# Points predicted at a time, always as many: one compilation serves all grids. With
# many rows fewer, 2**22 numbers of eight bytes being 32 MB.
_BLOCK, _MOST_VALUES = 16, 2**22


@partial(jax.jit, static_argnames=("effect", "names"))
def _curves(effect, names, values, base: Base, records: Records, reading: Reading):
    plain, _ = predict_reading(base, (), records, reading)

    def one(row):
        made = effect(**dict(zip(names, row, strict=True)))
        return predict_reading(base, (made,), records, reading)[0] - plain

    return jax.vmap(one)(values)


def curves(
    effect: type[Effect],
    values: dict[str, np.ndarray],
    base: Base,
    records: Records,
    reading: Reading,
) -> np.ndarray:
    """Return the effect's contribution to the mean reading [N].

    Args:
        effect: the effect.
        values: of every parameter, each of shape (g,).
        base: the force model about which it acts.
        records: the rows.
        reading: how the rig reads.

    Returns:
        Shape (g, n).
    """
    names = tuple(values)
    table = np.stack([np.asarray(values[name], float) for name in names], axis=1)
    block = int(np.clip(_MOST_VALUES // len(records.force), 1, _BLOCK))
    count = len(table)
    table = np.concatenate([table, np.repeat(table[-1:], -count % block, axis=0)])
    parts = [
        _curves(effect, names, table[i : i + block], base, records, reading)
        for i in range(0, len(table), block)
    ]
    return np.concatenate([np.asarray(part) for part in parts])[:count]
