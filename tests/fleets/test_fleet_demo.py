"""The bundled fleet is what its script makes, and is told as it was made."""

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
    names = np.array(found.case.specimen_labels)
    surest = np.argmax(found.off)
    assert found.called[surest] and names[surest] == MADE["OFF"]
    # At most one of twenty calls is of an ordinary gear, in the mean of many fleets.
    assert found.called.sum() <= 2 and (found.off[names != MADE["OFF"]] < 0.6).all()
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
    assert (found.lots, found.operators) == (["A", "B", "C"], ["K", "M"])
    for name, value in expected.items():
        low, high = np.quantile(found.draws[name], [0.005, 0.995])
        assert low < value < high, name
    soft = np.mean(found.stiffness[:, surest])
    centre = np.median(found.draws["stiffness"] * (1.0 + found.draws["lot_2"]))
    assert soft / centre == pytest.approx(MADE["SHARE"], abs=0.02)
