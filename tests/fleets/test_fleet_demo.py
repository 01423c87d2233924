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
    assert names[found.called].tolist() == [MADE["OFF"]]
    truth = MADE["TRUTH"]
    both = ("between_gears_percent", "between_lots_percent")
    expected = {
        "specimen_sd": 0.01 * np.hypot(*(truth[name] for name in both)),
        "sigma": truth["sigma_N"],
        "run_offset_sd": np.hypot(truth["between_mountings_N"], 0.15),
    }
    for name, value in expected.items():
        low, high = np.quantile(found.draws[name], [0.005, 0.995])
        assert low < value < high, name
    soft = found.stiffness[:, found.called].mean()
    centre = np.median(found.draws["stiffness"])
    assert soft / centre == pytest.approx(MADE["SHARE"], abs=0.02)
