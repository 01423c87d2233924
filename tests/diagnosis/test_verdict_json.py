"""verdict.json obeys its schema, and says in words what it says in numbers."""

import copy
import json
import math
from dataclasses import replace

import jsonschema
import numpy as np
import pytest
from rigs import cycles, make_case
from schema_checks import obeys
from verdicts import KINDS, NOISE, named

from hdcal.diagnosis.answer import VerdictAnswer, WhereAnswer
from hdcal.diagnosis.gap import Cell
from hdcal.diagnosis.places import places
from hdcal.diagnosis.summary import verdict_answer
from hdcal.quantities import FORCE
from hdcal.report.answer import json_schema
from hdcal.report.intervals import Interval
from hdcal.report.plain import as_json
from hdcal.report.words import likely, load, percent


def plain(kind: str) -> dict:
    """Return a verdict as it is read back from its file."""
    return json.loads(as_json(verdict_answer(KINDS[kind]())))


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_obeys_the_schema(kind: str):
    found = plain(kind)
    obeys(found, VerdictAnswer)
    assert sum(found["which"]["probabilities"].values()) == pytest.approx(1.0)
    assert found["status"] == ("failed" if kind == "failed" else "ok")


@pytest.mark.parametrize("part", ["", "gap", "where", "which", "shrink", "budget"])
def test_the_schema_misses_every_key_that_is_left_out(part: str):
    rules = json_schema(VerdictAnswer)
    rule = rules["properties"].get(part, {})
    # Either a table, or a table or nothing.
    table = next((one for one in rule.get("anyOf", [rule]) if "$ref" in one), None)
    place = table["$ref"].rpartition("/")[2] if table else None
    assert bool(place) == bool(part)
    keys = (rules["$defs"][place] if place else rules)["required"]
    assert len(keys) > 3
    whole = plain("named")
    for key in keys:
        found = copy.deepcopy(whole)
        del (found[part] if part else found)[key]
        with pytest.raises(jsonschema.ValidationError, match=key):
            obeys(found, VerdictAnswer)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("which.verdict", "perhaps"),
        ("which.effect", None),
        ("which.probabilities", {"none": 1.0}),
        ("which.probabilities", {"none": 1.2, "unknown": 0.0}),
        ("shrink.closed", None),
        ("status", "failed"),
        ("reasons", ["something"]),
        ("gap.detected", "yes"),
        ("gap.detected", False),
        ("next_test", []),
    ],
)
def test_the_schema_catches_what_contradicts_itself(path: str, value):
    found = plain("named")
    *parents, key = path.split(".")
    place = found
    for parent in parents:
        place = place[parent]
    place[key] = value
    with pytest.raises(jsonschema.ValidationError):
        obeys(found, VerdictAnswer)


def test_the_contract_of_the_format_holds():
    found = plain("named")
    region = found["where"]["regions"][0]
    keys = {"covariate", "from", "to", "unit", "bias_N", "z", "share"}
    assert keys <= region.keys()
    assert region["bias_N"].keys() == {"median", "lo", "hi"}
    sizes = [abs(cell["z"]) for cell in found["where"]["regions"]]
    assert sizes == sorted(sizes, reverse=True)
    assert found["which"]["not_testable"] == [{"effect": "ovality", "needs": ["angle"]}]
    amplitude = found["which"]["amplitude"]
    assert (amplitude["lo"], amplitude["median"], amplitude["hi"]) == (
        0.04,
        0.045,
        0.051,
    )
    assert [r["model"] for r in found["shrink"]["ladder"]][-1] == "noise"
    assert found["next_test"][0]["information_nats"] == 0.69
    assert plain("none")["shrink"]["closed"] is None


def test_what_is_not_a_number_is_null():
    verdict = named()
    gap = replace(verdict.gap, rms_N=Interval(math.nan, math.nan, math.inf))
    found = json.loads(as_json(verdict_answer(replace(verdict, gap=gap))))
    assert found["gap"]["rms_N"] == {"median": None, "lo": None, "hi": None}
    obeys(found, VerdictAnswer)


def test_readings_whose_neighbours_err_alike_are_said_to_tell_less():
    verdict = KINDS["none"]()
    assert not any("err alike" in line for line in verdict_answer(verdict).limits)
    alike = replace(verdict, gap=replace(verdict.gap, autocorrelation=0.8))
    told = verdict_answer(alike)
    rows = told.data.rows_diagnosed
    correlation = 0.8 ** np.abs(np.subtract.outer(np.arange(rows), np.arange(rows)))
    worth = np.linalg.inv(correlation).sum()
    assert f"{rows} tell about as much as {worth:.0f} independent" in told.limits[0]
    least = load(4.2 * NOISE / np.sqrt(worth))
    assert f"a gap of less than about {least} on average" in " ".join(told.answer)


def test_of_means_the_noise_is_that_of_a_mean():
    verdict = KINDS["none"]()
    # 144 rows in all, of which 48 means were looked at.
    case = make_case(cycles(144))
    verdict = replace(verdict, case=case, averaged_rows=3)
    found = verdict_answer(verdict)
    assert found.data.rows == 144 and found.data.averaged_rows == 3
    obeys(json.loads(as_json(found)), VerdictAnswer)


def test_what_is_not_seen_has_no_size():
    gap = plain("none")["gap"]
    assert gap["rms_N"] == {"median": None, "lo": None, "hi": None}
    assert gap["share_of_full_scale"] is None


def test_a_failed_diagnosis_answers_nothing():
    assert plain("failed")["answer"] == []


def cell(covariate: str, low: float, high: float, bias: float) -> Cell:
    """Return a cell, as far as words are made of it."""
    label = {"run": "run 3", "direction": "unloading"}.get(covariate, "loading, 1 mm")
    unit = {"time": "s", "temperature": "°C"}.get(covariate, "")
    size = Interval(bias, bias, bias)
    return Cell(covariate, label, low, high, unit, 1, size, 1.0, 1.0)


@pytest.mark.parametrize(
    ("region", "words"),
    [
        (cell("time", 1340.0, 2000.0, 1.0), "after 1340 s"),
        (cell("time", 0.0, 700.0, 1.0), "before 700 s"),
        (cell("time", 0.0, 2000.0, 1.0), "at every time"),
        (cell("temperature", 60.0, 60.0, 1.0), "at 60 °C"),
        (cell("run", math.nan, math.nan, 1.0), "in run 3"),
        (cell("direction", math.nan, math.nan, 1.0), "on unloading"),
        (cell("direction × deformation", 0.0, 1.0, 1.0), "for loading, 1 mm"),
    ],
)
def test_places_in_words(region: Cell, words: str):
    ends = cell("time", 0.0, 1.0, 0.0), cell("time", 1.0, 2000.0, 0.0)
    where = WhereAnswer(0.0, {}, (), (region,), (region, *ends))
    assert list(places(where, FORCE)) == [(words, 1.0)]


def test_numbers_in_words():
    assert [load(x) for x in (0.0312, 3.14, 31.4, 314.0, None)] == [
        "0.031 N",
        "3.1 N",
        "31 N",
        "314 N",
        "– N",
    ]
    assert [percent(x) for x in (-0.3, -0.003, 0.0, 0.001, 0.5, 0.999, 1.0, None)] == [
        "-30 %",
        "0 %",
        "< 1 %",
        "< 1 %",
        "50 %",
        "> 99 %",
        "> 99 %",
        "–",
    ]
    assert likely({"a": 0.3, "b": 0.65, "c": 0.05}) == ["b", "a"]
