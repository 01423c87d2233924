"""The bundled fleet is what its script makes, and its truth is found."""

import runpy

import numpy as np
import pytest

import hdcal
from hdcal.data.resources import datasets_folder

MADE = runpy.run_path(str(datasets_folder() / "make_fleet_demo.py"))


def test_the_table_is_that_of_its_script():
    text = (datasets_folder() / "fleet-demo" / "data.csv").read_text("utf-8")
    assert text == "\n".join([MADE["HEADER"], *MADE["simulate"](), ""])


@pytest.mark.thorough
def test_the_soft_gear_is_found_and_the_truth_held():
    found = hdcal.fleet(hdcal.read_case(datasets_folder() / "fleet-demo"))
    assert not found.reasons
    assert [one.gear for one in found.flagged] == [MADE["OFF"]]
    truth = MADE["TRUTH"]
    apart = 0.5 * truth["between_operators_N"]
    expected = {
        "specimen_sd": 0.01 * truth["between_gears_percent"],
        "lot_sd": 0.01 * truth["between_lots_percent"],
        "sigma": truth["sigma_N"],
        "run_offset_sd": truth["between_mountings_N"],
        "operator_1": -apart,
        "operator_2": apart,
    }
    assert [one.name for one in found.lots] == ["A", "B", "C"]
    assert [one.name for one in found.operators] == ["K", "M"]
    for name, value in expected.items():
        low, high = np.quantile(found.draws[name], [0.005, 0.995])
        assert low < value < high, name
    share = 1.0 + 0.01 * found.flagged[0].apart_percent.median
    assert share == pytest.approx(MADE["SHARE"], abs=0.02)
