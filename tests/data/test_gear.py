"""A gear file becomes sizes and priors: of the file, its certificates, the material."""

import math

import numpy as np
import pytest

from hdcal.data.gear import NO_MATERIAL, at_full_scale, read_gear
from hdcal.data.gear_file.certificates import is_stated
from hdcal.data.prior import REFERENCE, FullScale, Prior
from hdcal.data.priors import (
    MODEL_UNITS,
    SCALE_UNITS,
    effect_priors,
    material_priors,
    rig_priors,
)
from hdcal.data.reading import read_case
from hdcal.errors import InputError

SIZES = "[gear]\nwall_thickness_mm = 0.68\nradius_mm = 40\nlength_mm = 70.0\n"
SPRING = '[gear]\ntheory = "spring"\n'
MEASUREMENT = "[measurement]\n"
STIFF = 'K = { family = "lognormal", median = 3.0, log_sd = 0.2, unit = "kN/mm" }\n'
RING = '[priors]\nK = { family = "lognormal", median = 2, log_sd = 0.5 }\n'
RIG = FullScale(force=3700.0, deformation=0.1)


@pytest.fixture
def read(tmp_path):
    def reader(text="", above=SIZES, **given):
        path = tmp_path / "some-gear.toml"
        path.write_text(above + text)
        return read_gear(path, **given)

    return reader


def test_defaults(read):
    gear = read()
    assert gear.name == "some-gear"
    assert gear.geometry.load_height == gear.geometry.length == 70.0
    assert gear.geometry.poisson == 0.29
    assert (gear.theory, gear.reading, gear.material) == ("ring", "radial", "steel")
    assert gear.reference_temperature == 20.0
    assert gear.force_resolution == 0.0
    assert set(gear.priors) == set(MODEL_UNITS)
    assert set(gear.scale_priors) == set(SCALE_UNITS)
    assert gear.priors["K"].numbers == rig_priors()["K"].numbers == (2.0, 0.46)
    assert gear.priors["E0"].numbers == material_priors("steel")["E0"].numbers


def test_priors_are_stored_in_code_units(read):
    gear = read(
        "[priors]\n"
        'E0 = { family = "lognormal", median = 210.0, log_sd = 0.02, unit = "GPa" }\n'
        'alpha = { family = "uniform", low = 1, high = 4, unit = "1e-4/K" }\n'
        'force_offset = { family = "normal", mean = 0.1, sd = 1, unit = "kgf" }\n'
        'gap_sd = { family = "half_normal", sd = 3 }\n'
        '"slack.clearance" = { family = "half_normal", sd = 20, unit = "um" }\n'
        "[priors.coulomb_friction]\n"
        'slope = { family = "normal", mean = 0, sd = 2, unit = "N/degC" }\n'
    )
    assert gear.priors["E0"].numbers == pytest.approx((210e3, 0.02))
    assert gear.priors["E0"].unit == "MPa"
    assert gear.priors["alpha"].numbers == pytest.approx((1e-4, 4e-4))
    assert gear.priors["force_offset"].numbers == pytest.approx((0.980665, 9.80665))
    assert gear.scale_priors["gap_sd"].numbers == (3.0,)
    assert gear.priors["sigma"].numbers == rig_priors()["sigma"].numbers
    assert gear.effect_priors["slack.clearance"].numbers == pytest.approx((0.02,))
    assert gear.effect_priors["coulomb_friction.slope"].unit == "N/K"


def test_the_theory_of_the_prior_of_K(read):
    assert read('theory = "cup"\n').K_theory == "ring"
    assert read('theory = "cup"\n' + RING).K_theory == "cup"
    with pytest.raises(InputError, match="Did you mean 'article'"):
        read('theory = "artikel"\n')


def test_a_material_file(read, tmp_path):
    (tmp_path / "mine.toml").write_text(
        '[E0]\nfamily = "normal"\nmean = 70\nsd = 1\nunit = "GPa"\n'
        '[alpha]\nfamily = "fixed"\nvalue = 5\nunit = "1e-4/K"\n'
        '[poisson]\nfamily = "fixed"\nvalue = 0.33\n'
    )
    gear = read('material = "mine.toml"\n')
    assert gear.geometry.poisson == 0.33
    assert gear.priors["E0"].numbers == pytest.approx((70e3, 1e3))


# A spring.


def test_a_spring_needs_no_sizes(read):
    gear, shipped = read(above=SPRING), rig_priors()
    sizes = [getattr(gear.geometry, n) for n in ("wall_thickness", "radius", "length")]
    assert np.isnan(sizes).all() and gear.reach == math.inf
    assert (gear.K_theory, gear.material) == ("spring", NO_MATERIAL)
    for name in ("E0", "alpha", "K"):
        of_spring = {"E0": "spring_modulus", "alpha": "spring_alpha"}
        assert gear.priors[name] == shipped[of_spring.get(name, "spring_stiffness")]
    with pytest.raises(InputError) as error:
        read(above="[gear]\n")
    assert len(error.value.findings) == 3
    with pytest.raises(InputError, match="has no meaning"):
        read("[priors]\nE0 = { family = 'fixed', value = 2, unit = 'GPa' }", SPRING)


def test_the_prior_stiffness_of_a_spring_is_that_of_the_readings(tmp_path):
    """30 kN over 6 mm; every third reading is off by nothing, the others by steps."""
    rows = "".join(f"{0.12 * i:.2f},{0.6 * i + 0.2 * (i % 3):.2f}\n" for i in range(51))
    (tmp_path / "data.csv").write_text("deformation_mm,force_kN\n" + rows)
    gear = read_case(tmp_path / "data.csv").gear
    middle, log_sd = gear.priors["K"].numbers
    assert middle == pytest.approx(30.2e3 / 6.0, rel=0.05)
    assert log_sd == rig_priors()["spring_stiffness"].numbers[1]
    assert gear.priors["sigma"].numbers[0] == pytest.approx(0.005 * 30e3, rel=0.05)


# Full scale.


@pytest.mark.parametrize(
    ("unit", "ratio"),
    [
        ("N", 37.0),
        ("N*s/mm", 37.0 * 5.0),
        ("1/K", 1.0),
    ],
)
def test_newtons_and_millimetres_scale_with_the_readings(unit, ratio):
    prior = Prior("normal", (2.0, 3.0), unit)
    np.testing.assert_allclose(RIG.own(prior).numbers, (2.0 * ratio, 3.0 * ratio))
    assert REFERENCE.own(prior) is prior
    scaled, shipped = effect_priors(RIG), effect_priors()
    assert scaled["outliers.fraction"] == shipped["outliers.fraction"]
    reach, log_sd = shipped["hysteresis.reach"].numbers
    assert scaled["hysteresis.reach"].numbers == pytest.approx((0.2 * reach, log_sd))


def test_a_case_takes_the_scale_from_its_largest_readings(folder):
    w = np.linspace(0.01, 0.8, 200)
    w[17] = 40.0  # one wild reading in two hundred
    rows = "\n".join(f"{x!r},{50.0 * min(x, 1.0)!r}" for x in w.tolist())
    (folder / "data.csv").write_text(f"deformation_mm,force_N\n{rows}\n")
    stated = "[priors]\ncoulomb_friction.force = { family = 'half_normal', sd = 7.0 }\n"
    diametral = MEASUREMENT + 'deformation = "diametral"\n'
    (folder / "gear.toml").write_text(SIZES + diametral + stated)
    gear = read_case(folder).gear
    # Radial is half of what is read; of the readings one in a hundred may be wild.
    assert gear.full_scale.deformation == pytest.approx(0.4 * 0.98, rel=0.02)
    assert gear.full_scale.force == pytest.approx(40.0 * 0.98, rel=0.02)
    assert gear.effect_priors["coulomb_friction.force"].numbers == (7.0,)


def test_a_zero_that_nobody_states_may_be_anywhere():
    x = np.linspace(100.0, 101.0, 20)
    gear = read_case({"deformation_mm": x, "force_N": 5.0 * x}).gear
    # Ten times the range, the level and the way to the origin, 5 N/mm · 100.5 mm.
    zero = gear.priors["force_offset"].numbers
    assert zero == pytest.approx((0.0, 10.0 * (5.0 + 502.5 + 502.5)), rel=0.02)
    assert gear.full_scale.force == pytest.approx(5.0, rel=0.02)
    stated = {"force_offset": {"family": "normal", "mean": 1.0, "sd": 0.2, "unit": "N"}}
    given = {"theory": "spring", "priors": stated}
    gear = read_case({"deformation_mm": x, "force_N": 5.0 * x}, gear=given).gear
    assert gear.priors["force_offset"].numbers == (1.0, 0.2)


# Certificates.


def test_certificates_become_priors_of_gains_and_zeros(read):
    gear = read(
        MEASUREMENT
        + "force_calibration = { expanded_percent = 0.5, expanded_N = 0.3, k = 2.5 }\n"
        + "deformation_calibration = { expanded_percent = 0.2, expanded_mm = 0.004 }\n"
        + "temperature_calibration = { expanded_K = 1.0 }\n",
    )
    # k is 2 where it is not given.
    assert {name: prior.numbers for name, prior in gear.gauge_priors.items()} == {
        "force_gain": (0.0, pytest.approx(0.002)),
        "deformation_gain": (0.0, pytest.approx(0.001)),
        "temperature_offset": (0.0, 0.5),
    }
    assert gear.priors["force_offset"].numbers == (0.0, pytest.approx(0.12))
    contact = rig_priors()["deformation_offset"].numbers[1]
    wanted = pytest.approx(np.hypot(contact, 0.002))
    assert gear.priors["deformation_offset"].numbers == (0.0, wanted)


def test_a_prior_of_the_file_wins_over_a_certificate(read):
    prior = '[priors]\nforce_offset = { family = "normal", mean = 1.0, sd = 0.5 }\n'
    gear = read(MEASUREMENT + "force_calibration = { expanded_N = 0.3 }\n" + prior)
    assert gear.priors["force_offset"].numbers == (1.0, 0.5)
    assert gear.gauge_priors == {}


@pytest.mark.parametrize(
    ("family", "given", "wanted"),
    [
        ("normal", "mean = 0.01, sd = 0.003", (0.01, 0.005)),
        ("fixed", "value = 0.01", (0.01, 0.004)),
        # The sum with another distribution is none of the families: it stays.
        ("uniform", "low = -0.01, high = 0.03", (-0.01, 0.03)),
    ],
)
def test_a_displacement_gauge_adds_to_the_contact_point(read, family, given, wanted):
    certificate = "deformation_calibration = { expanded_mm = 0.008 }\n[priors]\n"
    prior = f'deformation_offset = {{ family = "{family}", {given}, unit = "mm" }}\n'
    offset = read(MEASUREMENT + certificate + prior).priors["deformation_offset"]
    assert offset.numbers == pytest.approx(wanted)
    assert is_stated(offset) == (family != "uniform")


# Facts of the rig.
FACTS = """
[rig]
load_cell_capacity_N = 200.0
gauge_range_mm = 5.0
displacement_pitch_mm = 0.5
filter_Hz = 2.0
"""


def correlation_of(text, with_time=True):
    """Return the prior of the correlation of neighbours in 20 rows at 20 Hz."""
    row = np.arange(20.0)
    table = {"deformation_mm": 0.01 * row, "force_N": 2.0 * row}
    table |= {"time_s": 0.05 * row} if with_time else {}
    return read_case(table, gear=text).gear.scale_priors["noise_correlation"]


@pytest.mark.parametrize(("reading", "radial"), [("radial", 1.0), ("diametral", 0.5)])
def test_each_fact_sharpens_one_prior(read, reading, radial):
    measured = f'{MEASUREMENT}deformation = "{reading}"\n'
    priors = read(measured + FACTS, SPRING).effect_priors
    # At capacity the cell loses the share that shipped priors have it lose at 100 N.
    lost = priors.pop("force_saturation.curvature").numbers[0] * 200.0**2
    assert lost == pytest.approx(8e-7 * 100.0**2)
    bent = priors.pop("displacement_nonlinearity.curvature").numbers[1] * 5.0 * radial
    assert bent == pytest.approx(0.04 * 0.5)
    pitch = priors.pop("screw_error.pitch").numbers[0]
    assert pitch == pytest.approx(0.5 * radial) and not priors
    given = '[priors.screw_error]\npitch = { family = "fixed", value = 3, unit = "mm" }'
    assert read(FACTS + given, SPRING).effect_priors["screw_error.pitch"].numbers == (
        3.0,
    )


def test_noise_behind_a_filter_is_correlated_as_the_prior_expects():
    rig = {"gear": {"theory": "spring"}, "rig": {"filter_Hz": 2.0}}
    a, b = correlation_of(rig).numbers
    assert a / (a + b) == pytest.approx(np.exp(-2 * np.pi * 2.0 * 0.05), abs=0.06)
    assert correlation_of(rig, with_time=False).family == "uniform"
    stated = {"noise_correlation": {"family": "fixed", "value": 0.1}}
    assert correlation_of({**rig, "priors": stated}).numbers == (0.1,)


@pytest.mark.parametrize("scale", [FullScale(1e9, 1e-6), FullScale(1e-9, 1e6)])
def test_the_stiffness_keeps_to_its_range_and_a_stated_one_stays(read, scale):
    middle = at_full_scale(read(above=SPRING), scale).priors["K"].numbers[0]
    assert 1e-12 <= middle <= 1e12
    stated = read("[priors]\n" + STIFF, SPRING)
    assert stated.priors["K"].numbers == pytest.approx((3000.0, 0.2))
    assert at_full_scale(stated, scale).priors["K"] == stated.priors["K"]
