"""Answers held against their schemas, each of which is made and checked once."""

from functools import cache

import jsonschema
from jsonschema.exceptions import best_match

from hdcal.report.answer import Answer, json_schema


@cache
def _checker(answer: type[Answer]) -> jsonschema.Draft202012Validator:
    schema = json_schema(answer)
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def obeys(found: object, answer: type[Answer]) -> None:
    """Check that plain data keeps what the schema of an answer promises.

    Raises:
        jsonschema.ValidationError: it does not.
    """
    error = best_match(_checker(answer).iter_errors(found))
    if error is not None:
        raise error
