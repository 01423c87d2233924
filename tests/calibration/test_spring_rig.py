"""A rig without a drawing goes the whole way, and what needs sizes is refused."""

import json
import re
from pathlib import Path

import pytest
from commands import ROOT, Hdcal
from schema_checks import obeys
from short import options

from hdcal.calibration.calibration import Calibration
from hdcal.diagnosis.result import Diagnosis

DAMPER = ROOT / "datasets" / "slit-damper"

# The damper's loop leaves correlated residuals, which mix slowly.
LONGER = {"warmup": 500, "draws": 1000}


@pytest.fixture
def calibrated(here: Hdcal, tmp_path: Path) -> Path:
    done = here("calibrate", DAMPER, *options(LONGER), "--out", "run")
    assert done.returncode == 0, done.stderr
    return tmp_path / "run"


def test_every_question_that_needs_no_sizes_is_answered(here: Hdcal, calibrated: Path):
    found = json.loads((calibrated / "summary.json").read_text())
    obeys(found, Calibration)
    assert found["K_by_theory"] == dict.fromkeys(("ring", "cup", "article"))
    assert found["parameters"]["K"]["unit"] == "N/mm"
    K, stiffness = found["parameters"]["K"], found["stiffness_N_per_mm"]
    assert K["median"] == pytest.approx(stiffness["median"], rel=1e-9)
    page = (calibrated / "report.html").read_text()
    assert not re.search(r"\bnan\b", page, re.IGNORECASE)
    assert "K under each theory" not in page
    # The modulus is a definition: among the priors, and not among what was found.
    assert page.count("E₀</td>") == 1
    asked = "margin", calibrated, "--deformation", 5, "--json"
    assert json.loads(here(*asked).stdout)["status"] == "ok"
    for question in ("design", "study"):
        about = {"design": ["--window", "1:2"], "study": ["--vary", "radius_mm=1:2:3"]}
        refused = here(question, calibrated, *about[question])
        assert refused.returncode == 2
        assert "'spring'" in refused.stderr and "sizes" in refused.stderr


@pytest.mark.thorough
def test_a_damper_that_yields_is_a_loop(here: Hdcal):
    done = here("diagnose", DAMPER, "--quick", "--json")
    found = json.loads(done.stdout)
    obeys(found, Diagnosis)
    assert "hysteresis" in found["which"]["causes"][0]["members"]
    told = " ".join(each["statement"] for each in found["seen"])
    assert "lower while the deformation decreases" in told
