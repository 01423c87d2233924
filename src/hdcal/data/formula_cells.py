"""Guards of texts that a spreadsheet would run as formulas.

A leading apostrophe makes a spreadsheet show the rest as text. Reading takes it away.
"""

from contextlib import suppress

_RUN = ("=", "+", "-", "@", "＝", "＋", "－", "＠", "\t", "\r")


def without_formula(text: str) -> str:
    """Return a text as it may stand in a cell; numbers are no formulas."""
    return f"'{text}" if _runs(text) else text


def with_formula(cell: str) -> str:
    """Return the text that `without_formula` made a cell of."""
    return cell.removeprefix("'") if _runs(cell) else cell


def _runs(text: str) -> bool:
    """Tell whether a spreadsheet would run a text, less its guards."""
    with suppress(ValueError):
        float(text)
        return False
    return text.lstrip("'").startswith(_RUN)
