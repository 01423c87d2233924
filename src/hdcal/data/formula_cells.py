"""Texts in tables that spreadsheets would run, written so that they do not.

A leading apostrophe makes a spreadsheet show the rest as text. Reading takes it away.
A spreadsheet may split cells at another character than the one that was written, and
does not heed quotes within a cell then: every part that might become a cell is guarded.
"""

import re

_RUN = ("=", "+", "-", "@", "＝", "＋", "－", "＠")
# These may be left out before what follows them.
_BLANK = ("\t", "\r")
_SEPARATORS = re.compile(r"([;,|\t\r\n])")


def without_formula(text: str) -> str:
    """Return a text as it may stand in a cell; numbers are no formulas."""
    parts = _SEPARATORS.split(text)
    # A part that is guarded already gets one more apostrophe, and keeps its own.
    parts[::2] = [f"'{part}" if _runs(part) else part for part in parts[::2]]
    guard = "'" if text.lstrip("'").startswith(_BLANK) else ""
    return guard + "".join(parts)


def with_formula(cell: str) -> str:
    """Return the text that `without_formula` made a cell of."""
    if cell.lstrip("'").startswith(_BLANK):
        cell = cell.removeprefix("'")
    parts = _SEPARATORS.split(cell)
    parts[::2] = [p.removeprefix("'") if _runs(p) else p for p in parts[::2]]
    return "".join(parts)


def _runs(part: str) -> bool:
    """Tell whether a spreadsheet would run a part: a formula, and no number."""
    if not part.lstrip("'").startswith(_RUN):
        return False
    try:
        float(part)
    except ValueError:
        return True
    return False
