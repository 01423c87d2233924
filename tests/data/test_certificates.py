"""A gear file states calibration certificates, as numbers or as a class."""

import numpy as np
import pytest

from hdcal.data.gear import read_gear
from hdcal.data.gear_file.certificates import CLASSES, is_stated
from hdcal.data.priors import rig_priors
from hdcal.errors import InputError

SIZES = "[gear]\nwall_thickness_mm = 0.68\nradius_mm = 40.0\nlength_mm = 70.0\n"
M = SIZES + "[measurement]\n"
FORCE = M + "force_calibration = {{ {} }}\n"
HERE = "measurement.force_calibration"


def gear(tmp_path, text: str):
    path = tmp_path / "gear.toml"
    path.write_text(text)
    return read_gear(path)


def numbers(found) -> dict:
    return {name: prior.numbers for name, prior in found.gauge_priors.items()}


def test_numbers_become_priors_of_gains_and_zeros(tmp_path):
    found = gear(
        tmp_path,
        FORCE.format("expanded_percent = 0.5, expanded_N = 0.3, k = 2.5")
        + "deformation_calibration = { expanded_percent = 0.2, expanded_mm = 0.004 }\n"
        + "temperature_calibration = { expanded_K = 1.0 }\n",
    )
    # k is 2 where it is not given.
    assert numbers(found) == {
        "force_gain": (0.0, pytest.approx(0.002)),
        "deformation_gain": (0.0, pytest.approx(0.001)),
        "temperature_offset": (0.0, 0.5),
    }
    assert found.priors["force_offset"].numbers == (0.0, pytest.approx(0.12))
    contact = rig_priors()["deformation_offset"].numbers[1]
    wanted = pytest.approx(np.hypot(contact, 0.002))
    assert found.priors["deformation_offset"].numbers == (0.0, wanted)


def test_a_prior_of_the_file_wins_over_a_certificate(tmp_path):
    prior = '[priors]\nforce_offset = { family = "normal", mean = 1.0, sd = 0.5 }\n'
    found = gear(tmp_path, FORCE.format("expanded_N = 0.3") + prior)
    assert found.priors["force_offset"].numbers == (1.0, 0.5)
    assert found.gauge_priors == {}


CONTACTS = {
    "normal": ("mean = 0.01, sd = 0.003", (0.01, 0.005)),
    "fixed": ("value = 0.01", (0.01, 0.004)),
    # Of other laws the sum is none that there is: the file's own word stays.
    "uniform": ("low = -0.01, high = 0.03", (-0.01, 0.03)),
}


@pytest.mark.parametrize("family", CONTACTS)
def test_a_displacement_gauge_adds_to_the_contact_point(tmp_path, family: str):
    """Its certificate says nothing of where the rig touches the gear."""
    given, wanted = CONTACTS[family]
    certificate = "deformation_calibration = { expanded_mm = 0.008 }\n[priors]\n"
    prior = f'deformation_offset = {{ family = "{family}", {given}, unit = "mm" }}\n'
    found = gear(tmp_path, M + certificate + prior).priors["deformation_offset"]
    assert found.numbers == pytest.approx(wanted)
    assert is_stated(found) == (family != "uniform")


PRESETS = [(kind, name) for kind, known in CLASSES.items() for name in known]


@pytest.mark.parametrize(("kind", "name"), PRESETS)
def test_every_class_is_a_gain(tmp_path, kind: str, name: str):
    found = gear(tmp_path, FORCE.format(f'{kind} = "{name}"'))
    assert numbers(found) == {"force_gain": (0.0, CLASSES[kind][name] / 200.0)}


def test_a_class_may_have_a_zero_beside_it_and_no_quotation_marks(tmp_path):
    text = FORCE.format("iso376_class = 0.5, expanded_N = 0.3, k = 3")
    found = gear(tmp_path, text)
    assert numbers(found) == {"force_gain": (0.0, pytest.approx(0.0009))}
    assert found.priors["force_offset"].numbers == (0.0, pytest.approx(0.1))


# ISO 376:2011, table 2, in %: reproducibility, repeatability, interpolation, zero,
# reversibility, creep, resolution as the smallest force allows it, expanded
# uncertainty of the forces it is calibrated with.
LIMITS = {
    "00": (0.05, 0.025, 0.025, 0.012, 0.07, 0.025, 0.025, 0.01),
    "0.5": (0.10, 0.05, 0.05, 0.025, 0.15, 0.05, 0.05, 0.02),
    "1": (0.20, 0.10, 0.10, 0.05, 0.30, 0.10, 0.10, 0.05),
    "2": (0.40, 0.20, 0.20, 0.10, 0.50, 0.20, 0.20, 0.10),
}


@pytest.mark.parametrize("name", LIMITS)
def test_the_iso_classes_are_their_limits_combined_and_rounded_up(name: str):
    spread, repeat, fit, zero, reverse, creep, step, forces = LIMITS[name]
    parts = [
        # three positions, two of them at one end of their range
        np.sqrt(2.0 / 3.0 * spread**2 / 6.0),
        *(limit / np.sqrt(3.0) for limit in (repeat, fit, creep)),
        zero,
        reverse / 3.0,
        step / np.sqrt(6.0),
        forces / 2.0,
    ]
    expanded = 2.0 * np.linalg.norm(parts)
    assert 0.9 * CLASSES["iso376_class"][name] < expanded
    assert expanded <= CLASSES["iso376_class"][name]


def test_the_astm_classes_are_one_over_their_smallest_force():
    assert CLASSES["astm_e74_class"] == {"A": 100.0 / 400.0, "AA": 100.0 / 2000.0}


BAD = {
    "empty": ("", HERE, "states no uncertainty"),
    "unknown": ("expanded_percnt = 1", f"{HERE}.expanded_percnt", "'expanded_percent'"),
    "of another gauge": ("expanded_mm = 1", f"{HERE}.expanded_mm", "unknown key"),
    "two gains": (
        'expanded_percent = 1, iso376_class = "1"',
        HERE,
        "states one gain as expanded_percent and as iso376_class",
    ),
    "unknown class": ('iso376_class = "0"', f"{HERE}.iso376_class", "unknown choice"),
    "k of a class": ('iso376_class = "1", k = 2', HERE, "Leave k out"),
    "k below one": ("expanded_N = 1, k = 0.5", f"{HERE}.k", "does not lie"),
    "negative": ("expanded_percent = -1", f"{HERE}.expanded_percent", "does not lie"),
    "a quarter": ("expanded_percent = 25", f"{HERE}.expanded_percent", "20 %"),
}


@pytest.mark.parametrize("name", BAD)
def test_each_fault_is_one_finding(tmp_path, name: str):
    text, key, words = BAD[name]
    with pytest.raises(InputError) as caught:
        gear(tmp_path, FORCE.format(text))
    (found,) = caught.value.findings
    assert (found.column, found.row) == (key, 6)
    assert words in f"{found.problem}. {found.remedy}"
