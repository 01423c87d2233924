"""Columns of labels: which one names the run, the specimen, the lot of a row."""

from collections.abc import Sequence
from itertools import pairwise

from hdcal.data.tables.blocks import ReadTable
from hdcal.data.tables.headers import GROUPINGS, Header


def label_columns(
    table: ReadTable, headers: Sequence[Header], quantity: str
) -> list[int]:
    """Return where the labels of a quantity stand, by headers and cells.

    Of columns that tell the same rows apart the first one, and of those that tell none
    apart one only where no other does. More than one: headers do not say which.

    Args:
        table: the readings.
        headers: what its headers mean.
        quantity: one of the labels.
    """
    found = [i for i, header in enumerate(headers) if header.quantity == quantity]
    exact = [i for i in found if headers[i].exact]
    if exact:
        return exact
    # One that names nothing else is meant rather than one that says more.
    found = [i for i in found if headers[i].whole] or found
    kinds: dict[tuple, int] = {}
    for place in found:
        labels = table.grid.texts(place)
        names = {label: index for index, label in enumerate(dict.fromkeys(labels))}
        if quantity not in GROUPINGS:
            # A number for each reading is no label of a run or a gear; a run lasts.
            counted = quantity == "run" and all(a != b for a, b in pairwise(labels))
            if counted or len(names) >= len(labels):
                continue
        kind = tuple(names[label] for label in labels) if len(names) > 1 else ()
        kinds.setdefault(kind, place)
    return [place for kind, place in kinds.items() if kind] or [*kinds.values()]
