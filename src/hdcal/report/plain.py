"""Results as plain data for JSON, and texts without control characters."""

import json
import math
from dataclasses import fields, is_dataclass
from typing import Any


def as_plain(value: Any) -> Any:
    """Return a value as JSON knows it; what is not finite becomes null.

    A field whose name is a keyword of Python, such as `from_`, loses its underscore.
    """
    if hasattr(value, "tolist"):  # NumPy, without importing it
        return as_plain(value.tolist())
    if is_dataclass(value) and not isinstance(value, type):
        value = {f.name.rstrip("_"): getattr(value, f.name) for f in fields(value)}
    if isinstance(value, dict):
        return {str(key): as_plain(item) for key, item in value.items()}
    if isinstance(value, set | frozenset):
        return as_plain(sorted(value))
    if isinstance(value, list | tuple):
        return [as_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def as_json(value: Any) -> str:
    """Return a result as the text of a JSON file."""
    return json.dumps(as_plain(value), indent=2, allow_nan=False) + "\n"


def printable(text: str) -> str:
    """Return a text from a file without characters that steer a terminal or XML."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)
