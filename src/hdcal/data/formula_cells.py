"""Texts in tables that spreadsheets would run, written so that they do not.

A leading apostrophe makes a spreadsheet show the rest as text. Reading takes it away.
"""

_RUN = ("=", "+", "-", "@", "\t", "\r")


def without_formula(text: str) -> str:
    """Return a text as it may stand in a cell; numbers are no formulas."""
    # What has been guarded by somebody else gets an apostrophe more, and keeps its own.
    if not text.lstrip("'").startswith(_RUN) or _is_number(text):
        return text
    return "'" + text


def with_formula(cell: str) -> str:
    """Return the text that `without_formula` made a cell of."""
    if cell.startswith("'") and cell.lstrip("'").startswith(_RUN):
        return cell[1:]
    return cell


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
