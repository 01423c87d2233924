"""Answers as JSON: the base of every answer, and the schemas of all of them."""

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from hdcal.quantities import FORCE, Quantities
from hdcal.report.result_schema import DIALECT, schema_with_units


class Promise:
    """What a generated schema says of a value beyond its type.

    Args:
        nullable: the value may be null.
        keywords: of JSON Schema, such as minimum or pattern.
    """

    def __init__(self, *, nullable: bool = False, **keywords: Any):
        self._nullable, self._keywords = nullable, keywords

    def __get_pydantic_json_schema__(self, core, handler) -> dict:
        """Return the schema of the type with these keywords."""
        schema = {**handler(core), **self._keywords}
        return {"anyOf": [schema, {"type": "null"}]} if self._nullable else schema


class _Unwritten:
    """What a generated schema leaves out."""

    def __get_pydantic_json_schema__(self, core, handler) -> dict:
        from pydantic_core import PydanticOmit

        raise PydanticOmit


# Names and units of what was measured, which an answer holds and does not write.
Units = Annotated[Quantities, _Unwritten()]
# A float that is null in JSON where it is not finite.
Real = Annotated[float, Promise(nullable=True)]
# Sums of many probabilities may end a rounding error above one.
Probability = Annotated[float, Promise(nullable=True, minimum=0, maximum=1.000001)]
Count = Annotated[int, Promise(minimum=0)]
Words = Annotated[str, Promise(minLength=1)]
Sentences = tuple[Words, ...]
EffectName = Annotated[str, Promise(pattern="^[A-Za-z_][A-Za-z0-9_]*$")]
Digest = Annotated[str, Promise(pattern="^[0-9a-f]{64}$")]


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What every JSON answer begins with.

    Attributes:
        schema: name and version of its format.
        status: whether the result may be used.
        reasons: why it may not.
        headline: the answer in one sentence.
        next_step: what to do next in one sentence, or None.
        units: names and units of what was measured; no part of the JSON answer.
    """

    # What the parts of an answer promise each other, as JSON Schema.
    RULES: ClassVar[tuple[dict, ...]] = (
        {
            "if": {"properties": {"status": {"const": "failed"}}},
            "then": {"properties": {"reasons": {"minItems": 1}}},
            "else": {"properties": {"reasons": {"maxItems": 0}}},
        },
    )

    schema: str
    status: Literal["ok", "failed"]
    reasons: Sentences
    headline: Words
    next_step: Words | None
    units: Units = FORCE


def json_schema(answer: type[Answer], units: Quantities = FORCE) -> dict:
    """Return the JSON schema of an answer, generated from its class.

    Args:
        answer: its class.
        units: names and units of what was measured.
    """
    from pydantic import TypeAdapter

    found = TypeAdapter(answer).json_schema(mode="serialization")
    rules = {"allOf": list(answer.RULES)} if answer.RULES else {}
    written = schema_with_units(_as_written(found), units)
    return {"$schema": DIALECT, **written, **rules}


def _as_written(schema: Any) -> Any:
    """Return a schema of what the serialiser writes.

    Every field is there, and an underscore that only Python needs is not.
    """
    if isinstance(schema, list):
        return [_as_written(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    found = {key: _as_written(item) for key, item in schema.items()}
    if isinstance(found.get("properties"), dict):
        fields = {name.rstrip("_"): item for name, item in found["properties"].items()}
        found |= {"properties": fields, "required": list(fields)}
    return found
