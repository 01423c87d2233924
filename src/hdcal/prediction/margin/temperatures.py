"""Many temperatures: computed at some of them, and in between by straight lines.

Between two temperatures near each other a force is straight in the temperature but for
the draws that change places in a quantile; probabilities go by their normal scores,
which are as straight.
"""

from collections.abc import Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
from scipy.special import ndtr

from hdcal.data.records import Records
from hdcal.prediction.margin.result import Exceedance, Level

# Beyond so many temperatures not every one is computed, but so many of them.
_MOST_COMPUTED, _NODES = 1_000, 300
# An answer has a row of some hundred bytes for each: a hundred thousand are 100 MB.
MOST_TEMPERATURES = 100_000
# Rows of a table and points of a picture.
_MOST_SHOWN = 200
_SCORES = {
    "probability": "beta",
    "lo": "beta_hi",
    "hi": "beta_lo",
    "at_confidence": "beta_at_confidence",
}


def nodes_of(temperature: np.ndarray, records: Records) -> np.ndarray:
    """Return the temperatures [°C] to compute, some of those that are asked for.

    Of many these are both ends, some between at even distances, and those beside the
    ends of the tested ones, where the rig begins to drift.
    """
    if len(temperature) <= _MOST_COMPUTED:
        return temperature
    levels = np.unique(temperature)
    ends = np.min(records.temperature), np.max(records.temperature)
    wanted = np.concatenate([np.linspace(levels[0], levels[-1], _NODES), ends, ends])
    rows = np.searchsorted(levels, wanted)
    rows[-2:] -= 1
    return levels[np.unique(np.clip(rows, 0, len(levels) - 1))]


def levels_between(
    levels: Sequence[Level], temperature: np.ndarray, tested: np.ndarray
) -> tuple[Level, ...]:
    """Return what holds at each temperature, from what holds at the computed ones.

    Args:
        levels: at `nodes_of` the temperatures.
        temperature: all that are asked for [°C].
        tested: which of them the data hold.
    """
    nodes = np.array([level.temperature_C for level in levels])
    if len(nodes) == len(temperature):
        return tuple(levels)
    rows = _between(list(levels), nodes, temperature)
    return tuple(
        replace(level, temperature_C=float(at), tested=bool(inside))
        for level, at, inside in zip(rows, temperature, tested, strict=True)
    )


def _between(parts: list[Any], nodes: np.ndarray, at: np.ndarray) -> list[Any]:
    """Return dataclasses of numbers, or numbers, between those at the nodes."""
    first = parts[0]
    if first is None or isinstance(first, bool):
        return [first] * len(at)
    if not is_dataclass(first):
        return np.interp(at, nodes, parts).tolist()
    names = [field.name for field in fields(first)]
    columns = {n: _between([getattr(p, n) for p in parts], nodes, at) for n in names}
    if isinstance(first, Exceedance):
        columns |= {p: ndtr(-np.array(columns[b])).tolist() for p, b in _SCORES.items()}
    kind: Any = type(first)
    return [kind(*row) for row in zip(*(columns[n] for n in names), strict=True)]


def shown_levels(levels: Sequence[Level]) -> Sequence[Level]:
    """Return so many levels as a table or a picture can hold, evenly."""
    if len(levels) <= _MOST_SHOWN:
        return levels
    rows = np.linspace(0, len(levels) - 1, _MOST_SHOWN).round().astype(int)
    return [levels[row] for row in rows]
