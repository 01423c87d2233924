"""A diagnosis whose models were calibrated, and one of a part that is twisted."""

from functools import partial
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from diagnosis_cases import simulated
from rigs import cycles
from schema_checks import obeys
from short import SHORT

import hdcal
from hdcal.calibration.calibrate import calibrate
from hdcal.data.reading import read_case
from hdcal.diagnosis.diagnose import diagnose
from hdcal.diagnosis.result import Diagnosis
from hdcal.physics.registry import EFFECTS

LOOP = {"coulomb_friction": {"force": 2.0}}


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    case = simulated(cycles(48), LOOP, seed=1)
    with pytest.MonkeyPatch.context() as patch:
        short = partial(calibrate, **SHORT)
        patch.setattr("hdcal.calibration.calibrate.calibrate", short)
        library = {name: EFFECTS[name] for name in ("coulomb_friction", "outliers")}
        return diagnose(case, library=library)


def test_the_models_are_weighed_by_their_probabilities(found: Diagnosis):
    assert found.status == "ok" and found.left_out is not None
    assert sum(one.probability for one in found.refits) == pytest.approx(1.0)
    assert "coulomb_friction" in found.refits[0].hypothesis
    stiffness = found.stiffness_N_per_mm
    assert stiffness is not None and stiffness.lo < 195.0 < stiffness.hi
    obeys(found.to_dict(), Diagnosis)


def test_what_is_saved_is_loaded_and_predicts_the_same(
    found: Diagnosis, tmp_path: Path
):
    average = found.average
    assert average is not None
    path = tmp_path / "posterior.nc"
    path.write_bytes(average.to_netcdf())
    loaded = hdcal.ModelAverage.load(path)
    assert {*loaded.posteriors} == {*found.posteriors}
    assert loaded.left_out == found.left_out
    before, after = (
        hdcal.predict(models, [0.2, 0.4], [20.0]).to_frame()
        for models in (average, loaded)
    )
    numbers = dict(before.select_dtypes("number"))
    assert len(numbers) > 4
    for name, values in numbers.items():
        np.testing.assert_allclose(after[name], values, rtol=1e-6)


def twisted() -> dict[str, np.ndarray]:
    """Return readings of a spring twisted back and forth, with friction."""
    rng = np.random.default_rng(2)
    up = np.linspace(0.01, 0.3, 30)
    angle = np.tile(np.concatenate([up, up[::-1]]), 3)
    side = np.tile(np.repeat([1.0, -1.0], 30), 3)
    torque = 40.0 * angle + 0.4 * side + rng.normal(0.0, 0.05, angle.size)
    return {"angle_rad": angle, "torque_Nm": torque}


def test_torques_over_angles_have_their_units():
    table = twisted()
    found = diagnose(read_case(table), quick=True)
    members = {name for cause in found.which.acting for name in cause.members}
    assert members & {"coulomb_friction", "hysteresis", "load_friction"}
    assert found.part == "part" and found.gap.noise_sd_N == pytest.approx(0.05, rel=0.2)
    jsonschema.validate(found.to_dict(), Diagnosis.json_schema(found.units))
    text, names = found.text(), {*found.to_dict()["gap"]}
    assert "N·m" in text and "N/mm" not in text and "gear" not in text.lower()
    assert names & {"rms_Nm", "rms_N_m"}
    assert "force" not in " ".join(one.statement for one in found.seen)
    assert "formula" not in " ".join(rung.model for rung in found.how_far.ladder)
