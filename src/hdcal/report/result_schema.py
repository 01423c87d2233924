"""JSON Schema of results."""

from typing import Any

from pydantic.json_schema import GenerateJsonSchema

DIALECT = "https://json-schema.org/draft/2020-12/schema"


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
