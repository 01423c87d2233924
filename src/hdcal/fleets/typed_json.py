"""Plain data of a JSON file as the types that its writer had, and nothing else."""

import json
from functools import cache
from typing import Annotated, Any, TypeVar

from pydantic import ConfigDict, Field, TypeAdapter

T = TypeVar("T")

# Of dataclasses, as `__pydantic_config__`: no other fields, no text for a number.
STRICT = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)
Size = Annotated[float, Field(ge=0.0, le=1e12)]
Count = Annotated[int, Field(ge=0, le=10**12)]
Number = Annotated[float, Field(ge=-1e12, le=1e12)]


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
