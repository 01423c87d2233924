"""Answers as JSON: the base of every answer, and the schemas of all of them."""

from dataclasses import dataclass
from typing import Annotated, Any, Literal

DIALECT = "https://json-schema.org/draft/2020-12/schema"


class _OrNull:
    """Tells a generated schema that a number may be missing."""

    def __get_pydantic_json_schema__(self, core, handler) -> dict:
        return {"anyOf": [handler(core), {"type": "null"}]}


# A float that is null in JSON where it is not finite.
Real = Annotated[float, _OrNull()]


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What every JSON answer begins with.

    Attributes:
        schema: name and version of its format.
        status: whether the result may be used.
        reasons: why it may not.
        headline: the answer in one sentence.
        next_step: what to do next in one sentence, or None.
    """

    schema: str
    status: Literal["ok", "failed"]
    reasons: tuple[str, ...]
    headline: str
    next_step: str | None


def json_schema(answer: type[Answer]) -> dict:
    """Return the JSON schema of an answer, generated from its class."""
    from pydantic import TypeAdapter

    found = TypeAdapter(answer).json_schema(mode="serialization")
    return {"$schema": DIALECT, **_without_underscores(found)}


def _without_underscores(schema: Any) -> Any:
    """Rename the fields that carry an underscore only because Python needs it."""
    if isinstance(schema, list):
        return [_without_underscores(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    found = {key: _without_underscores(item) for key, item in schema.items()}
    if isinstance(found.get("properties"), dict):
        found["properties"] = {
            name.rstrip("_"): item for name, item in found["properties"].items()
        }
        if "required" in found:
            found["required"] = [name.rstrip("_") for name in found["required"]]
    return found
