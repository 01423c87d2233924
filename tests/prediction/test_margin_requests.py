"""Requests that have no answer are refused, all of their faults at once."""

from dataclasses import replace
from inspect import signature

import numpy as np
import pytest
from posteriors import plain_draws, ramp_case, single, spring, written_posterior
from rigs import make_gear

import hdcal
from hdcal.data.prior import Prior
from hdcal.errors import InputError, NotUsable
from hdcal.inference.checks import Check
from hdcal.prediction.conditions import excluded_findings


@pytest.fixture(scope="module")
def one():
    return single(size=400)


def fields(refused) -> list[str]:
    return [finding.where for finding in refused.value.findings]


def test_a_failed_calibration_gives_no_margin(one):
    failed = replace(one, checks=(Check("made to fail", "failed", "on purpose"),))
    for models in (failed, [(0.9, one), (0.1, failed)]):
        with pytest.raises(NotUsable, match="made to fail"):
            hdcal.margin(models, 0.4)


# One request a fault; the field that the finding has to name is the first one.
BAD = [
    {"deformation": 400.0},
    {"deformation": np.nan},
    {"deformation": 0.0},
    {"deformation": [0.3, 0.4]},
    {"deformation": "0.3 mm"},
    {"limit_force": 120_000.0},
    {"limit_force": np.inf},
    {"limit_force": 0.0},
    {"limit_force": [80.0]},
    {"limit_force": -90.0},
    {"given_force": 80_000.0},
    {"temperature": []},
    {"temperature": [20.0] * 1001},
    {"temperature": [-300.0]},
    {"temperature": "warm"},
    {"temperature": [[20.0]]},
    {"temperature": [2500.0]},
    {"content": 99.0},
    {"content": 1.0 - 1e-9},
    {"confidence": 0.9999},
    {"confidence": 1.0},
    {"population": "planets"},
    {"population": "mountings"},
    {"population": "specimens"},
    {"quantity": "torque"},
    {"direction": "sideways"},
    {"rule": "strict", "limit_force": 90.0},
    {"rule": "simple"},
    {"seed": -1},
    {"tolerances": {"colour_mm": 0.1}},
    {"tolerances": {"wall_thickness_mm": 20.0}},
    {"tolerances": {"load_height_mm": 1.0}},
    {"tolerances": {"radius_mm": -0.1}},
]


@pytest.mark.parametrize("asked", BAD, ids=str)
def test_a_bad_request_is_refused_by_its_field(one, asked: dict):
    with pytest.raises(InputError) as refused:
        hdcal.margin(one, **{"deformation": 0.4, **asked})
    assert fields(refused) == [next(iter(asked))]
    assert {*fields(refused)} <= {*signature(hdcal.margin).parameters}
    assert refused.value.findings[0].remedy


def test_all_faults_are_found_at_once(one):
    with pytest.raises(InputError) as refused:
        hdcal.margin(one, 400.0, temperature=[], content=2.0, population="specimens")
    expected = ["deformation", "temperature", "content", "population"]
    assert fields(refused) == expected
    # No force is compared with a deformation that is refused.
    with pytest.raises(InputError) as refused:
        hdcal.margin(one, 400.0, limit_force=100.0, given_force=80.0)
    assert fields(refused) == ["deformation"]


def test_a_deformation_far_from_the_readings_is_a_slip_of_the_unit():
    """A spring has no radius, which a deformation could be larger than."""
    assert hdcal.margin(spring(), 0.4).part == "part"
    for ask in (hdcal.margin, lambda p, at: hdcal.predict(p, [at])):
        with pytest.raises(InputError, match="Give the deformation in mm") as refused:
            ask(spring(), 400.0)
        assert fields(refused) == ["deformation"]


def test_a_load_needs_the_place_of_first_contact():
    def posterior(shift: float, **priors):
        case = ramp_case(make_gear(**priors))
        moved = replace(case.records, deformation=case.records.deformation + shift)
        case = replace(case, records=moved)
        return written_posterior(case, plain_draws(case, 400))

    stated = Prior("normal", (5.0, 0.01), "mm", "the rig's zero")
    assert hdcal.margin(posterior(0.0), 0.4, quantity="load")
    assert hdcal.margin(posterior(5.0), 5.4)
    assert hdcal.margin(posterior(5.0, deformation_offset=stated), 5.4, quantity="load")
    with pytest.raises(InputError) as refused:
        hdcal.margin(posterior(5.0), 5.4, quantity="load")
    assert fields(refused) == ["quantity"]


def test_models_have_probabilities_and_are_of_the_same_data(one):
    other = replace(one, case=replace(one.case, data_sha256="1" * 64))
    for models in (
        [(0.5, one), (0.5, other)],
        [],
        [(-1.0, one), (2.0, one)],
        [one, one],
        [(0.0, one)],
        "no model",
        None,
        hdcal.margin(one, 0.3),
    ):
        with pytest.raises(InputError) as refused:
            hdcal.margin(models, 0.4)
        assert fields(refused) == ["models"]


@pytest.mark.parametrize("left_out", [1, -1])
def test_a_movement_whose_readings_were_left_out_is_refused(one, left_out: int):
    """Named by what the deformation does, whatever side is loaded."""
    case = replace(one.case, excluded_sense=left_out)
    movement = {1: "increases", -1: "decreases"}[left_out]
    (found,) = excluded_findings(case, 0.3, float(left_out))
    assert found.file == "direction" and movement in found.problem
    assert not excluded_findings(case, 0.3, -float(left_out))


def test_a_member_is_named_by_its_population(one):
    of_load = hdcal.margin(one, 0.4, quantity="load")
    assert (hdcal.margin(one, 0.4).member, of_load.member) == ("reading", "load")
