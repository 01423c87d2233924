"""A torque over an angle is a torsional spring, named so in every answer."""

import re

import numpy as np
import pandas as pd
import pytest
from jsonschema import Draft202012Validator

import hdcal
from hdcal.calibration.calibration import Calibration, calibration_of
from hdcal.calibration.check.check import check
from hdcal.cli.option_types import read_quantity, unit_findings
from hdcal.diagnosis.result import Diagnosis
from hdcal.errors import InputError
from hdcal.prediction.margin.result import Margin
from hdcal.quantities import FORCE, TORQUE

STIFFNESS = 9000.0  # [N·m/rad]
SHORT = {"chains": 2, "warmup": 300, "draws": 1000, "seed": 1}
ARCMIN, DEGREE = np.pi / 10800.0, np.pi / 180.0
POUND_INCH = 0.0254 * 4.4482216152605  # [N·m]


def _readings(torque_unit: float, angle_unit: float, torque: str, angle: str) -> dict:
    up = np.linspace(0.0, 12.0 * ARCMIN, 25)
    way = np.concatenate([up, up[-2::-1]])
    sense = np.where(np.arange(way.size) < up.size, 1.0, -1.0)
    noise = np.random.default_rng(3).normal(0.0, 0.05, way.size)
    load = STIFFNESS * way + 0.4 * sense + noise
    return {angle: way / angle_unit, torque: load / torque_unit}


def _file(tmp_path, name: str, table: dict):
    path = tmp_path / name
    pd.DataFrame(table).to_csv(path, index=False, float_format="%.9g")
    return path


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    table = _readings(1.0, ARCMIN, "Torque [Nm]", "Twist [arcmin]")
    return hdcal.read_case(_file(tmp_path_factory.mktemp("t"), "a.csv", table))


@pytest.fixture(scope="module")
def posterior(case):
    return hdcal.calibrate(case, effects=["coulomb_friction"], **SHORT)


def _keys_and_units(value) -> set[str]:
    """Return all keys of an answer, and the units that it names."""
    if isinstance(value, dict):
        unit = {value["unit"]} if isinstance(value.get("unit"), str) else set()
        return {*value}.union(unit, *map(_keys_and_units, value.values()))
    if isinstance(value, list):
        return set().union(*map(_keys_and_units, value))
    return set()


def _is_of_torques(answer: dict) -> bool:
    names = _keys_and_units(answer)
    ends = ("_N", "_mm", "_N_per_mm")
    return not any(name.endswith(ends) or name in ("N", "mm", "N/mm") for name in names)


@pytest.mark.parametrize(
    ("torque", "angle", "sizes"),
    [
        ("torque_Nm", "angle_rad", (1.0, 1.0)),
        ("Moment (mNm)", "Drehwinkel (arcmin)", (1e-3, ARCMIN)),
        ("load [lbf*in]", "travel [deg]", (POUND_INCH, DEGREE)),
    ],
)
def test_units_do_not_matter(tmp_path, torque, angle, sizes):
    found = hdcal.read_case(_file(tmp_path, "b.csv", _readings(*sizes, torque, angle)))
    own = hdcal.read_case(_readings(1.0, 1.0, "torque_Nm", "angle_rad"))
    assert found.units is TORQUE
    for name in ("deformation", "force"):
        read, expected = (getattr(c.records, name) for c in (found, own))
        np.testing.assert_allclose(read, expected, rtol=1e-7, atol=1e-9)
    assert [*found.to_frame().columns] == ["angle_rad", "torque_Nm"]
    slope = found.screening.straight.slope
    assert slope == pytest.approx(STIFFNESS, rel=0.01)


def test_columns_may_be_named(tmp_path):
    table = _readings(1.0, ARCMIN, "Kanal 1", "Kanal 2")
    path = _file(tmp_path, "c.csv", table)
    named = {"torque": "Kanal 1[Nm]", "angle": "Kanal 2[arcmin]"}
    found = hdcal.read_case(path, columns=named)
    assert found.columns == {"torque": "Kanal 1[Nm]", "angle": "Kanal 2[arcmin]"}
    assert found.units is TORQUE


def test_the_check_is_of_torques(case):
    found = check(case)
    told = found.to_dict()
    assert _is_of_torques(told)
    assert told["data"]["torque_N_m"][1] == pytest.approx(31.5, rel=0.05)
    assert told["screening"]["straight_part"]["stiffness_N_m_per_rad"] > 0.0
    Draft202012Validator(type(found).json_schema(TORQUE)).validate(told)
    page = found.page()
    assert "N·m/rad" in page
    assert "N/mm" not in page
    assert found.charts()["readings"].panels[0].y == "torque as read [N·m]"


def test_the_calibration_is_of_torques(posterior):
    found = calibration_of(posterior)
    told = found.to_dict()
    assert _is_of_torques(told)
    stiffness = told["stiffness_N_m_per_rad"]
    assert stiffness["lo"] < STIFFNESS < stiffness["hi"]
    assert stiffness["hi"] - stiffness["lo"] < 0.05 * STIFFNESS
    assert told["parameters"]["K"]["unit"] == "N·m/rad"
    assert told["parameters"]["coulomb_friction.force"]["unit"] == "N·m"
    Draft202012Validator(Calibration.json_schema(TORQUE)).validate(told)
    for words in (found.headline, found.text(), found.page()):
        assert "N·m/rad" in words
        assert "N·m/arcmin" in words
        assert "N/mm" not in words
        assert " mm" not in words
    axes = {panel.x for chart in found.charts().values() for panel in chart.panels}
    assert not [axis for axis in axes if "mm]" in axis or "[N]" in axis]


def test_a_saved_posterior_knows_its_quantities(posterior, tmp_path):
    path = tmp_path / "posterior.nc"
    path.write_bytes(posterior.to_netcdf())
    again = hdcal.Posterior.load(path)
    assert again.case.units is TORQUE
    assert again.tree["posterior"]["stiffness"].attrs["units"] == "N·m/rad"
    bands = hdcal.predict(again, [0.001, 0.003])
    assert "angle_rad" in bands.to_frame()
    assert _is_of_torques(dict.fromkeys(bands.to_frame().columns))
    told = bands.to_dict()
    assert _is_of_torques(told)
    assert "N·m" in told["headline"]
    with pytest.raises(InputError, match="rad"):
        hdcal.predict(again, [0.5 / ARCMIN])


def test_the_diagnosis_is_of_torques(case):
    found = hdcal.diagnose(case, quick=True)
    assert "coulomb_friction" in found.which.causes[0].members
    told = found.to_dict()
    assert _is_of_torques(told)
    assert told["gap"]["rms_N_m"]["median"] == pytest.approx(0.4, rel=0.2)
    Draft202012Validator(Diagnosis.json_schema(TORQUE)).validate(told)
    words = found.page()
    assert "torque" in words
    assert " force " not in words.replace("force saturation", "")
    assert " N " not in words
    charts = found.charts()["where"].panels
    assert charts[0].x == "angle as read [rad]"
    assert charts[0].y == "measured − model [N·m]"


@pytest.mark.parametrize("ask", [hdcal.fit, hdcal.causes, hdcal.calibrate_dynamic])
def test_what_is_of_forces_refuses_torques(case, ask):
    with pytest.raises(InputError, match="torque"):
        ask(case)


def test_a_gear_file_of_forces_is_refused(case):
    table = _readings(1.0, 1.0, "torque_Nm", "angle_rad")
    sized = {"wall_thickness_mm": 0.68, "radius_mm": 40.0, "length_mm": 70.0}
    with pytest.raises(InputError, match="theory"):
        hdcal.read_case(table, sized)


@pytest.mark.parametrize(
    ("sizes", "name"),
    [({"radius_mm": 40.0}, "radius_mm"), ({"deformation": "diametral"}, "deformation")],
)
def test_a_torsional_spring_has_no_radius_and_no_diameter(case, sizes, name):
    table = _readings(1.0, 1.0, "torque_Nm", "angle_rad")
    with pytest.raises(InputError, match=name):
        hdcal.read_case(table, {"theory": "spring", **sizes})


def test_a_length_with_its_unit_is_no_angle():
    given = {"deformation": read_quantity("0.4 mm", "--deformation", unit="mm")}
    (finding,) = unit_findings(TORQUE, **given)
    assert finding.where == "deformation"
    assert not [*unit_findings(FORCE, **given)]
    alone = read_quantity("0.004", "--deformation", unit="mm")
    assert not [*unit_findings(TORQUE, deformation=alone)]


def test_a_margin_is_of_torques(posterior):
    at = 8.0 * ARCMIN
    found = hdcal.margin(posterior, at, limit_force=30.0, given_force=20.0)
    told = found.to_dict()
    assert _is_of_torques(told)
    assert told["worst"]["torque_N_m"]["median"] == pytest.approx(21.3, rel=0.03)
    assert told["reached"]["median_rad"] == pytest.approx(20.0 / STIFFNESS, rel=0.05)
    Draft202012Validator(Margin.json_schema(TORQUE)).validate(told)
    text = re.sub(r"<(style|script|svg).*?</\1>", "", found.page(), flags=re.DOTALL)
    for words in (told["headline"], *told["remarks"], text):
        assert not re.search(r"[{}]| mm\b|N/mm| N\b(?!·)", words)
    assert "N·m" in told["headline"]
