"""Answers held against their schemas, each of which is made and checked once."""

from functools import cache

import jsonschema
from jsonschema.exceptions import best_match

from hdcal.report.answer import json_schema
from hdcal.report.result import Result


@cache
def _checker(answer: type) -> jsonschema.Draft202012Validator:
    is_result = issubclass(answer, Result)
    schema = answer.json_schema() if is_result else json_schema(answer)
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def obeys(found: object, answer: type) -> None:
    """Check that plain data keeps what the schema of an answer promises.

    Raises:
        jsonschema.ValidationError: it does not.
    """
    error = best_match(_checker(answer).iter_errors(found))
    if error is not None:
        raise error
