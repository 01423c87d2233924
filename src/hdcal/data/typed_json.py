"""Plain data of a JSON file as the types that its writer had, and nothing else."""

import json
from functools import cache
from typing import Annotated, Any, TypeVar

from pydantic import ConfigDict, Field, TypeAdapter

from hdcal.data.plausible import range_of

T = TypeVar("T")

# Of dataclasses, as `__pydantic_config__`: no other fields, no text for a number.
STRICT = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)
# Names of things go into tables and figures: `a`, `a.b`, `a+b` or `a b`.
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_.+ -]{1,200}$")]
Share = Annotated[float, Field(ge=0.0, le=1.001)]  # a sum may pass 1 by rounding
Size = Annotated[float, Field(ge=0.0, le=1e12)]
Count = Annotated[int, Field(ge=0, le=10**12)]
Number = Annotated[float, Field(ge=-1e12, le=1e12)]


def within(quantity: str) -> Any:
    """Return the constraint of a field to the range of a quantity.

    Args:
        quantity: a key of `RANGES` or `NAMES`.
    """
    known = range_of(quantity)
    if known.inner:
        return Field(gt=known.low, lt=known.high)
    return Field(ge=known.low, le=known.high)


def parse_json(text: bytes) -> Any:
    """Parse JSON that holds no number that is not finite and no key twice.

    Raises:
        ValueError: it is none.
    """
    try:
        data = json.loads(text, object_pairs_hook=_unique)
        # What a writer could not write again is refused here: 1e999, deep nesting.
        json.dumps(data, allow_nan=False)
    except RecursionError:
        raise ValueError("nested too deeply") from None
    return data


def typed(kind: type[T], data: Any) -> T:
    """Return plain data as a type.

    Args:
        kind: such as a dataclass with the configuration `STRICT`.
        data: as parsed from JSON.

    Raises:
        ValueError: they are something else, or not finite.
    """
    try:
        text = json.dumps(data, allow_nan=False)
    except (TypeError, RecursionError):
        raise ValueError("is no plain data") from None
    return _adapter(kind).validate_json(text, strict=True)


def typed_text(kind: type[T], text: str) -> T:
    """Return JSON as a type; numbers need not be finite.

    Raises:
        ValueError: it is something else.
    """
    return _adapter(kind).validate_json(text)


@cache
def _adapter(kind: Any) -> TypeAdapter:
    return TypeAdapter(kind)


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("holds a key twice")
    return found
