"""Texts in tables that spreadsheets would run, written so that they do not.

A leading apostrophe makes a spreadsheet show the rest as text. Reading takes it away.
A spreadsheet may split cells at another character than the one that was written, and
does not heed quotes within a cell then: every part that might become a cell is guarded.
"""

import re
from contextlib import suppress

_RUN = ("=", "+", "-", "@", "＝", "＋", "－", "＠", "\t", "\r")
_PARTS = re.compile(r"(?<=[;,|\t\r\n])")


def without_formula(text: str) -> str:
    """Return a text as it may stand in a cell; numbers are no formulas."""
    # A part that is guarded already gets one more apostrophe, and keeps the first.
    return "".join(f"'{part}" if _runs(part) else part for part in _PARTS.split(text))


def with_formula(cell: str) -> str:
    """Return the text that `without_formula` made a cell of."""
    return "".join(p.removeprefix("'") if _runs(p) else p for p in _PARTS.split(cell))


def _runs(part: str) -> bool:
    """Tell whether a spreadsheet would run a part: a formula, and no number."""
    with suppress(ValueError):
        float(part.rstrip(";,|"))
        return False
    return part.lstrip("'").startswith(_RUN)
