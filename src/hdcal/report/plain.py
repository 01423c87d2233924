"""JSON texts, and texts without control characters."""

import json
from typing import Any


def as_json(value: Any) -> str:
    """Return plain data as the text of a JSON file."""
    return json.dumps(value, indent=2, allow_nan=False) + "\n"


def printable(text: str) -> str:
    """Return a text from a file without characters that steer a terminal or XML."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)
