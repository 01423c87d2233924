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
from hdcal.diagnosis.words import NO_PROOF, PROPORTIONAL
from hdcal.report.answer import json_schema
from hdcal.report.intervals import Interval
from hdcal.report.plain import as_json
from hdcal.report.words import likely, newton, percent


def plain(kind: str) -> dict:
    """Return a verdict as it is read back from its file."""
    return json.loads(as_json(verdict_answer(KINDS[kind]())))


def text(kind: str) -> str:
    """Return the answer as one text."""
    return " ".join(plain(kind)["answer"])


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


def test_a_named_cause_is_told_without_statistics():
    words = text("named")
    assert "2.1 N higher than the calibrated model above 0.367 mm" in words
    assert "0.78 N lower on unloading" in words
    assert "Most likely cause: hysteresis (96 %); its loop width is 0.045" in words
    assert "removes 91 % (85 … 95 %) of the gap on half-cycles that it was not" in words
    assert words.endswith("To be surer: unload at the same rate.")
    for jargon in ("posterior", "prior", "evidence", "credible", "hypothes", "Bayes"):
        assert jargon not in words


def test_no_gap_says_what_would_be_too_small_to_see():
    words = text("none")
    assert "No gap is seen" in words
    assert "Too small to be seen here: a gap of less than about 0.2 N" in words
    assert NO_PROOF not in plain("none")["limits"]


def test_ambiguity_names_all_candidates_and_the_next_run():
    words = text("ambiguous")
    assert "progressive stiffening (55 %), seating slack (38 %)" in words
    assert "Next run: take ten finer steps below 0.1 mm." in words
    limits = " ".join(plain("ambiguous")["limits"])
    assert "coulomb friction (needs unloading)" in limits
    assert "charge leakage (needs holds, time)" in limits


def test_candidates_come_in_the_order_of_what_is_shown():
    """With pairs among them they sum to more than one, and that is said."""
    verdict = KINDS["ambiguous"]()
    which = replace(
        verdict.which,
        set=("none", "seating_slack", "progressive_stiffening"),
        inclusion={"seating_slack": 0.5, "progressive_stiffening": 0.7},
    )
    told = " ".join(verdict_answer(replace(verdict, which=which)).answer)
    order = "progressive stiffening (70 %), seating slack (50 %), no gap (2 %)"
    assert f"it may be {order}; what acts together counts for each." in told
    assert "acts together" not in text("ambiguous")


def test_readings_whose_neighbours_err_alike_are_said_to_tell_less():
    verdict = KINDS["none"]()
    assert not any("err alike" in line for line in verdict_answer(verdict).limits)
    alike = replace(verdict, gap=replace(verdict.gap, autocorrelation=0.8))
    told = verdict_answer(alike)
    rows = told.data.rows_diagnosed
    correlation = 0.8 ** np.abs(np.subtract.outer(np.arange(rows), np.arange(rows)))
    worth = np.linalg.inv(correlation).sum()
    assert f"{rows} tell about as much as {worth:.0f} independent" in told.limits[0]
    least = newton(4.2 * NOISE / np.sqrt(worth))
    assert f"a gap of less than about {least} on average" in " ".join(told.answer)


def test_the_unknown_is_called_so():
    assert "Nothing in the library explains all of it" in text("unknown")


def said(verdict, **parts) -> str:
    """Return the answer of a verdict, some values of its parts replaced."""
    new = {
        part: replace(getattr(verdict, part), **values)
        for part, values in parts.items()
    }
    return " ".join(verdict_answer(replace(verdict, **new)).answer)


def test_an_unknown_that_only_leads_is_said_with_a_reserve():
    chances = {"none": 0.3, "hysteresis": 0.32, "unknown": 0.34, "ovality": 0.04}
    words = said(KINDS["unknown"](), which={"probabilities": chances})
    assert "Nothing in the library" not in words and "most likely" not in words
    assert "may lie outside the library (34 %); next comes hysteresis (32 %)" in words


def test_rounding_alone_is_told_without_a_chance():
    where = {"p_value": 1.0, "cells": ()}
    words = said(named(), gap={"rounding_N": 2.0}, where=where)
    assert words.startswith("The readings are rounded to steps of 2 N;")
    assert "p = " not in words and "depart" not in words


def test_of_means_the_noise_is_that_of_a_mean():
    verdict = KINDS["none"]()
    # 144 rows in all, of which 48 means were looked at.
    case = make_case(cycles(144))
    verdict = replace(verdict, case=case, averaged_rows=3)
    found = verdict_answer(verdict)
    assert found.data.rows == 144 and found.data.averaged_rows == 3
    obeys(json.loads(as_json(found)), VerdictAnswer)
    words = " ".join(found.answer)
    assert "the noise of a mean of 3 readings is 0.3 N" in words
    # 4.2 · 0.3 / √((48 − 46 · 0.1) / (1 + 0.1))
    assert "a gap of less than about 0.2 N" in words
    assert "the noise of a reading is 0.3 N" in text("none")


def test_what_is_not_seen_has_no_size():
    gap = plain("none")["gap"]
    assert gap["rms_N"] == {"median": None, "lo": None, "hi": None}
    assert gap["share_of_full_scale"] is None


@pytest.mark.parametrize("kind", KINDS)
def test_what_a_diagnosis_cannot_see_is_always_said(kind: str):
    found = plain(kind)
    assert PROPORTIONAL in found["limits"]
    assert (NO_PROOF in found["limits"]) == (found["shrink"]["closed"] is not None)


def test_of_many_pairs_of_one_shape_those_that_matter_are_named():
    (words,) = (line for line in plain("named")["limits"] if "never tell" in line)
    assert words.startswith("This program can never tell coulomb friction from hyst")
    assert "nor 2 other pairs" in words
    verdict = named()
    fewer = replace(verdict.which, inseparable=verdict.which.inseparable[1:])
    found = verdict_answer(replace(verdict, which=fewer))
    assert any("nor 1 other pair" in line for line in found.limits)


@pytest.mark.parametrize(
    ("statistic", "words"),
    [
        ("p_spread", "the departure is in their scatter"),
        ("p_largest", "by 1.5 N rms (p"),
    ],
)
def test_a_gap_without_a_range_that_is_off(statistic: str, words: str):
    verdict = named()
    none = Interval(0.0, -1.0, 1.0)
    cells = tuple(replace(c, bias_N=none) for c in verdict.where.cells)
    chances = {"largest": 3.0, "p_spread": 0.5, "p_largest": 0.6, statistic: 0.001}
    where = replace(verdict.where, cells=cells, statistics=chances)
    gap = replace(verdict.gap, rms_N=Interval(1.5, 1.0, 2.0))
    assert words in verdict_answer(replace(verdict, where=where, gap=gap)).answer[0]


def test_a_failed_diagnosis_answers_nothing():
    assert plain("failed")["answer"] == []


def test_touching_ranges_of_one_sign_are_one_place():
    found = plain("ambiguous")
    # Lower than the model in three neighbouring ranges, higher on either side.
    assert "1.4 N lower than the calibrated model from 0.107 to 0.367 mm" in text(
        "ambiguous"
    )
    assert len(found["where"]["regions"]) == 5


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
    assert list(places(where)) == [(words, 1.0)]


def test_numbers_in_words():
    assert [newton(x) for x in (0.0312, 3.14, 31.4, 314.0, None)] == [
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


def test_a_pair_that_nothing_describes_better_is_told_beside_unknown():
    pair = "coulomb_friction+progressive_stiffening"
    weighed = {"none": 0.0, "unknown": 1.0, pair: 13.0, "hysteresis+unknown": 12.8}
    words = said(KINDS["unknown"](), which={"log_evidence": weighed})
    assert "better than coulomb friction and progressive stiffening" in words
    assert "No single effect in the library" in words
    weighed["hysteresis+unknown"] = 13.1
    for without in (weighed, {}):
        words = said(KINDS["unknown"](), which={"log_evidence": without})
        assert "effects act at once" not in words
        assert "Nothing in the library explains all of it" in words
