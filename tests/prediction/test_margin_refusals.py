"""Questions that have no answer are refused, all at once and before any work."""

from dataclasses import replace
from inspect import signature

import numpy as np
import pytest
from posteriors import single

import hdcal
from hdcal.errors import InputError, NotUsable
from hdcal.inference.checks import Check


@pytest.fixture(scope="module")
def one():
    return single()


def test_a_failed_calibration_gives_no_margin(one):
    failed = replace(one, checks=(Check("made to fail", "failed", "on purpose"),))
    with pytest.raises(NotUsable, match="made to fail"):
        hdcal.margin(failed, 0.4)
    with pytest.raises(NotUsable, match="made to fail"):
        hdcal.margin([(0.9, one), (0.1, failed)], 0.4)


BAD = {
    "deformation in um": ({"deformation": 400.0}, "Give it in mm"),
    "no deformation": ({"deformation": np.nan}, "nan mm does not lie"),
    "limit in mN": ({"limit_force": 120_000.0}, "Give it in N"),
    "limit in kN": ({"limit_force": 0.12}, "Give it in N"),
    "no limit": ({"limit_force": np.inf}, "inf N does not lie"),
    "given in mN": ({"given_force": 80_000.0}, "Give it in N"),
    "empty window": ({"temperature": []}, "empty window"),
    "endless window": ({"temperature": [20.0] * 100_001}, "at most 100000"),
    "below zero": ({"temperature": [-300.0]}, "absolute zero"),
    "in kelvin by far": ({"temperature": [2500.0]}, "half of Young's modulus"),
    "content 99": ({"content": 99.0}, "does not lie between 0 and 1"),
    "confidence 1": ({"confidence": 1.0}, "does not lie between 0 and 1"),
    "too sure": ({"confidence": 0.9999}, "cannot tell a confidence"),
    "certainty": ({"required_probability": 1.0}, "does not lie between 0 and 1"),
    "too rare": ({"required_probability": 1.0 - 1e-12}, "can promise"),
    "unknown population": ({"population": "planets"}, "is unknown"),
    "unknown quantity": ({"quantity": "torque"}, "is unknown"),
    "unknown direction": ({"direction": "sideways"}, "is unknown"),
    "unknown size": ({"tolerances": {"colour_mm": 0.1}}, "is no size"),
    "tolerance in um": ({"tolerances": {"wall_thickness_mm": 20.0}}, "Give it in mm"),
    "negative": ({"tolerances": {"radius_mm": -0.1}}, "-0.1 mm does not lie between 0"),
    "no part of ring": ({"tolerances": {"load_height_mm": 1.0}}, "theory 'ring'"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_questions_are_refused(one, name):
    asked, words = BAD[name]
    asked = {"deformation": 0.4, **asked}
    with pytest.raises(InputError, match=words) as caught:
        hdcal.margin(one, **asked)
    (finding,) = caught.value.findings
    assert finding.file in signature(hdcal.margin).parameters


def test_everything_bad_is_said_at_once(one):
    with pytest.raises(InputError) as caught:
        hdcal.margin(one, 400.0, temperature=[], content=2.0, population="specimens")
    assert len(caught.value.findings) == 4


def test_beside_a_wrong_deformation_no_force_is_blamed(one):
    with pytest.raises(InputError) as refused:
        hdcal.margin(one, 400.0, limit_force=100.0, given_force=80.0)
    assert [finding.file for finding in refused.value.findings] == ["deformation"]


def test_models_of_other_data_are_refused(one):
    other = replace(one, case=replace(one.case, data_sha256="1" * 64))
    with pytest.raises(InputError, match="same data"):
        hdcal.margin([(0.5, one), (0.5, other)], 0.4)
    for models in ([], [(0.0, one)], [(-1.0, one), (2.0, one)]):
        with pytest.raises(InputError, match="no probability"):
            hdcal.margin(models, 0.4)


@pytest.mark.parametrize("given", [[0.3, 0.4], "0.3 mm", {}, [[1], [2, 3]], 1j])
def test_one_number_is_asked_at_a_time(one, given):
    with pytest.raises(InputError, match="deformation: is not one number"):
        hdcal.margin(one, given)
    with pytest.raises(InputError, match="limit_force: is not one number"):
        hdcal.margin(one, 0.3, limit_force=given)


def test_of_temperatures_and_shares_numbers_are_asked(one):
    with pytest.raises(InputError) as refused:
        hdcal.margin(one, None, temperature="warm", content="x")
    told = {finding.file for finding in refused.value.findings}
    assert told == {"deformation", "temperature", "content"}


def test_forces_are_asked_at_numbers(one):
    with pytest.raises(InputError, match="deformation: is no list of numbers"):
        hdcal.predict(one, {"deformation_mm": [0.3]})


def test_another_result_is_no_calibration(one):
    with pytest.raises(InputError, match="a Margin is not a calibration"):
        hdcal.summarise(hdcal.margin(one, 0.3, sensitivities=False))
