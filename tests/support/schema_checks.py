"""Answers held against their schemas, each of which is made and checked once."""

from functools import cache

import jsonschema
from jsonschema.exceptions import best_match

from hdcal.report.result import Result


@cache
def _checker(answer: type[Result]) -> jsonschema.Draft202012Validator:
    schema = answer.json_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def obeys(found: object, answer: type[Result]) -> None:
    """Check that plain data keeps what the schema of an answer promises.

    Raises:
        jsonschema.ValidationError: it does not.
    """
    error = best_match(_checker(answer).iter_errors(found))
    if error is not None:
        raise error
