"""Every answer has a published schema of its own, made from its class."""

import sys
from pathlib import Path

import jsonschema
import pytest

from hdcal.report.result import Result

sys.path.insert(0, str(Path(__file__).parents[2] / "docs" / "_ext"))

from schemas import answers, file_name

ALL = answers()


@pytest.mark.parametrize("name", ALL)
def test_a_schema_is_valid_and_names_its_format(name: str):
    schema = ALL[name].json_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    format_, *kind = name.split()
    assert schema["properties"]["schema"]["const"] == format_
    assert kind in ([], [schema["properties"].get("kind", {}).get("const")])
    assert {"status", "reasons", "headline", "next_step"} <= set(schema["required"])
    assert set(schema["required"]) == set(schema["properties"])
    assert schema["description"].splitlines()[0].endswith(".")
    assert not {"/", " "} & set(file_name(name))


def test_nothing_else_passes_for_an_answer():
    schema = Result.json_schema()
    good = {
        "schema": "hdcal.any/1",
        "status": "ok",
        "reasons": [],
        "headline": "The gear is stiff.",
        "next_step": None,
    }
    jsonschema.validate(good, schema)
    for wrong in ({"status": "failed"}, {"reasons": ["why"]}, {"headline": ""}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(good | wrong, schema)
