"""A torque over an angle is a torsional spring, named so in every answer."""

import re

import numpy as np
import pandas as pd
import pytest
from jsonschema import Draft202012Validator

import hdcal
from hdcal.calibration.calibration import calibration_of
from hdcal.calibration.check.check import check
from hdcal.errors import InputError
from hdcal.fleets.reading.read_fleet import read_fleet, usable
from hdcal.quantities import TORQUE

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


@pytest.fixture(scope="module")
def answers(case, posterior) -> dict:
    limits = {"limit_force": 30.0, "given_force": 20.0}
    return {
        "check": check(case),
        "calibration": calibration_of(posterior),
        "diagnosis": hdcal.diagnose(case, quick=True),
        "margin": hdcal.margin(posterior, 8.0 * ARCMIN, **limits),
        "bands": hdcal.predict(posterior, [0.001, 0.003]),
    }


@pytest.mark.parametrize(
    "name", ["check", "calibration", "diagnosis", "margin", "bands"]
)
def test_every_answer_is_of_torques(answers, name: str):
    found = answers[name]
    told = found.to_dict()
    assert _is_of_torques(told)
    assert _is_of_torques(dict.fromkeys(found.to_frame().columns))
    Draft202012Validator(type(found).json_schema(TORQUE)).validate(told)
    page = re.sub(r"<(style|script|svg).*?</\1>", "", found.page(), flags=re.DOTALL)
    assert not re.search(r"[{}]| mm\b|N/mm", page)
    # Sources of priors, in the page only, may speak of newtons.
    assert not re.search(r"[{}]| mm\b|N/mm| N\b(?!·)", found.text())
    axes = {
        axis for c in found.charts().values() for p in c.panels for axis in (p.x, p.y)
    }
    assert not [axis for axis in axes if "mm]" in axis or "[N]" in axis]


def test_the_numbers_are_those_of_the_torsional_spring(answers):
    told = {name: answer.to_dict() for name, answer in answers.items()}
    assert told["check"]["data"]["torque_N_m"][1] == pytest.approx(31.5, rel=0.05)
    stiffness = told["calibration"]["stiffness_N_m_per_rad"]
    assert stiffness["lo"] < STIFFNESS < stiffness["hi"]
    assert stiffness["hi"] - stiffness["lo"] < 0.05 * STIFFNESS
    parameters = told["calibration"]["parameters"]
    assert parameters["K"]["unit"] == "N·m/rad"
    assert parameters["coulomb_friction.force"]["unit"] == "N·m"
    assert "N·m/arcmin" in answers["calibration"].headline
    assert "coulomb_friction" in answers["diagnosis"].which.causes[0].members
    gap = told["diagnosis"]["gap"]["rms_N_m"]
    assert gap["median"] == pytest.approx(0.4, rel=0.2)
    margin = told["margin"]
    assert margin["worst"]["torque_N_m"]["median"] == pytest.approx(21.3, rel=0.03)
    assert margin["reached"]["median_rad"] == pytest.approx(20.0 / STIFFNESS, rel=0.05)


def test_a_saved_posterior_knows_its_quantities(posterior, tmp_path):
    posterior.save(tmp_path / "posterior.nc")
    again = hdcal.Posterior.load(tmp_path)
    assert again.case.units is TORQUE
    assert again.tree["posterior"]["stiffness"].attrs["units"] == "N·m/rad"
    with pytest.raises(InputError, match="rad"):
        hdcal.predict(again, [0.5 / ARCMIN])


@pytest.mark.parametrize("ask", [hdcal.fit, hdcal.causes, hdcal.calibrate_dynamic])
def test_what_is_of_forces_refuses_torques(case, ask):
    with pytest.raises(InputError, match="torque"):
        ask(case)


@pytest.mark.parametrize(
    ("gear", "name"),
    [
        ({"wall_thickness_mm": 0.68, "radius_mm": 40.0, "length_mm": 70.0}, "theory"),
        ({"theory": "spring", "radius_mm": 40.0}, "radius_mm"),
        ({"theory": "spring", "deformation": "diametral"}, "deformation"),
    ],
)
def test_a_torsional_spring_has_no_sizes(gear, name):
    with pytest.raises(InputError, match=name):
        hdcal.read_case(_readings(1.0, 1.0, "torque_Nm", "angle_rad"), gear)


def test_a_fleet_of_torques_refuses_forces(tmp_path):
    table = _readings(1.0, ARCMIN, "Torque [Nm]", "Twist [arcmin]")
    for name in "abc":
        _file(tmp_path, f"{name}.csv", table)
    found = read_fleet(tmp_path)
    assert found.case.units is TORQUE
    products = found.sums.products
    assert products[:, 0, 3] / products[:, 0, 0] == pytest.approx(STIFFNESS, rel=0.02)
    forces = {"deformation_mm": range(6), "force_N": [0, 20.1, 39.9, 60.2, 80, 99.8]}
    _file(tmp_path, "d.csv", forces)
    with pytest.raises(InputError, match="contains forces"):
        usable(read_fleet(tmp_path))
