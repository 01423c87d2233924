"""Which columns name the run or the specimen of a row, in other words than ours."""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Protocol

import pandas as pd

from hdcal.data.header_words import guess_header


class Texts(Protocol):
    """A table whose cells can be had as texts."""

    @property
    def headers(self) -> Sequence[str]:
        """Of its columns."""
        ...

    def texts(self, columns: Iterable[int]) -> dict[int, list[str]]:
        """Cells of some columns, by position."""
        ...


def label_columns(table: Texts, quantity: str) -> list[int]:
    """Return where the labels of a quantity stand, by their headers and their cells.

    Of columns that tell the same rows apart the first one, and of those that tell none
    apart one only where no other does. More than one: headers do not say which.

    Args:
        table: whose headers are read.
        quantity: run or specimen.
    """
    guesses = [*map(guess_header, table.headers)]
    found = [
        i for i, g in enumerate(guesses) if g is not None and g.quantity == quantity
    ]
    # One that names nothing else is meant rather than one that says more.
    found = [i for i in found if (g := guesses[i]) is not None and g.whole] or found
    kinds: dict[bytes, int] = {}
    for place, labels in table.texts(found).items():
        index, names = pd.factorize(pd.Series(labels))
        # A number for each reading is no label of a run or a gear, and a run lasts.
        counted = quantity == "run" and all(a != b for a, b in pairwise(labels))
        if not counted and len(names) < len(labels):
            kinds.setdefault(index.tobytes() if len(names) > 1 else b"", place)
    return [place for kind, place in kinds.items() if kind] or [*kinds.values()]
