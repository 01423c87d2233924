"""Effects from outside must bear padded rows: a load that is held at the end."""

from collections.abc import Sequence
from functools import partial

import jax
import numpy as np

from hdcal.data.records import Records
from hdcal.errors import Finding, InputError
from hdcal.inference.padding import bucket_size, pad_records, repeat_last_row
from hdcal.physics.chain import Base, Reading, predict_reading
from hdcal.physics.effect import Effect, parameters
from hdcal.physics.registry import EFFECTS

# A gear of ordinary stiffness without noise to hide behind [N/mm, N].
_BASE = (200.0, 0.0, 0.0, 0.0, 1.0)
_SAME = 1e-9


def check_padding(
    effects: Sequence[type[Effect]], records: Records, reading: Reading
) -> None:
    """Refuse an effect for which rows after the last one change those before.

    Those of the library do not; their tests see to it.

    Args:
        effects: in the model.
        records: the measured rows.
        reading: how the rig reads.

    Raises:
        InputError: with every effect that does.
    """
    foreign = [effect for effect in effects if effect not in EFFECTS.values()]
    if not foreign:
        return
    rows, short = len(records.force), pad_records(records)
    long = repeat_last_row(records, bucket_size(len(short.force) + 1))
    findings = []
    for effect in foreign:
        few, many = (
            np.stack(_reading(padded, reading, effect=effect))[..., :rows]
            for padded in (short, long)
        )
        scale = np.max(np.abs(few))
        if not np.allclose(few, many, rtol=0.0, atol=_SAME * scale, equal_nan=True):
            words = "changes rows when further ones follow them"
            remedy = "Let `apply` look at a row and those before it, not at all rows"
            findings.append(Finding(f"effect {effect.name}", words, remedy))
    if findings:
        raise InputError(findings)


@partial(jax.jit, static_argnames=("effect",))
def _reading(records: Records, reading: Reading, *, effect: type[Effect]):
    """Return mean and noise of the rows with the effect at its typical size."""
    sizes = {name: about.typical for name, about in parameters(effect).items()}
    mean, noise = predict_reading(Base(*_BASE), (effect(**sizes),), records, reading)
    return [mean, *noise.sd]
