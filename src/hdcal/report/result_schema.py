"""JSON Schema of results."""

from typing import Any

from pydantic.json_schema import GenerateJsonSchema

from hdcal.quantities import Quantities

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema_with_units(schema: Any, units: Quantities) -> Any:
    """Return a schema whose fields are named after what was measured."""
    if isinstance(schema, list):
        return [schema_with_units(item, units) for item in schema]
    if not isinstance(schema, dict):
        return schema
    found = {key: schema_with_units(item, units) for key, item in schema.items()}
    if isinstance(found.get("properties"), dict):
        found["properties"] = {
            units.key(name): item for name, item in found["properties"].items()
        }
        found["required"] = [*map(units.key, found.get("required", ()))]
    if isinstance(found.get("unit"), str):
        found["unit"] = units.unit(found["unit"])
    return found


class ResultSchema(GenerateJsonSchema):
    """JSON Schema in which floats may be null unless NaN is refused.

    Later versions may add keys.
    """

    def model_schema(self, schema: Any) -> dict[str, Any]:
        """Return an object to which keys may be added."""
        found = super().model_schema(schema)
        found.pop("additionalProperties", None)
        return found

    def float_schema(self, schema: Any) -> dict[str, Any]:
        """Return a number that may be null."""
        found = super().float_schema(schema)
        finite = schema.get("allow_inf_nan") is False
        return found if finite else {"anyOf": [found, {"type": "null"}]}
