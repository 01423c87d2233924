"""Results as plain data for JSON, and texts without control characters."""

import json
import math
from dataclasses import fields, is_dataclass
from typing import Any

from hdcal.quantities import FORCE, Quantities


def as_plain(value: Any, units: Quantities = FORCE) -> Any:
    """Return a value as JSON knows it; what is not finite becomes null.

    A field whose name is a keyword of Python, such as `from_`, loses its underscore.
    Fields are named after what was measured, which the field `units` of an answer says.
    """
    if hasattr(value, "tolist"):  # NumPy, without importing it
        return as_plain(value.tolist())
    if is_dataclass(value) and not isinstance(value, type):
        units = getattr(value, "units", units)
        held = {f.name: getattr(value, f.name) for f in fields(value)}
        held = {n: v for n, v in held.items() if not isinstance(v, Quantities)}
        if isinstance(named := held.get("covariate"), str):
            held["covariate"] = units.name(named)
        value = {units.key(name.rstrip("_")): item for name, item in held.items()}
    if isinstance(value, dict):
        return {str(key): as_plain(item, units) for key, item in value.items()}
    if isinstance(value, set | frozenset):
        return as_plain(sorted(value))
    if isinstance(value, list | tuple):
        return [as_plain(item, units) for item in value]
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
