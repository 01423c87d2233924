"""The gear file wins over the material, the material over the shipped rig."""

import pytest

from hdcal.data.gear import read_gear
from hdcal.data.priors import MODEL_UNITS, SCALE_UNITS, material_priors, rig_priors
from hdcal.errors import InputError

SIZES = "[gear]\nwall_thickness_mm = 0.68\nradius_mm = 40\nlength_mm = 70.0\n"


@pytest.fixture
def read(tmp_path):
    def reader(text="", theory=None):
        path = tmp_path / "some-gear.toml"
        path.write_text(SIZES + text)
        return read_gear(path, theory)

    return reader


def test_defaults(read):
    gear = read()
    assert gear.name == "some-gear"
    assert gear.geometry.load_height == gear.geometry.length == 70.0
    assert gear.geometry.poisson == 0.29
    assert (gear.theory, gear.reading, gear.material) == ("ring", "radial", "steel")
    assert gear.reference_temperature == 20.0
    assert gear.force_resolution == 0.0
    assert gear.nominal_deformation is None
    assert set(gear.priors) == set(MODEL_UNITS)
    assert set(gear.scale_priors) == set(SCALE_UNITS)
    assert gear.priors["K"].numbers == rig_priors()["K"].numbers
    assert gear.priors["E0"].numbers == material_priors("steel")["E0"].numbers


def test_overrides_are_stored_in_code_units(read):
    gear = read(
        "[priors]\n"
        'E0 = { family = "lognormal", median = 210.0, log_sd = 0.02, unit = "GPa" }\n'
        'alpha = { family = "uniform", low = 1, high = 4, unit = "1e-4/K" }\n'
        'force_offset = { family = "normal", mean = 0.1, sd = 1, unit = "kgf" }\n'
        'deformation_offset = { family = "normal", mean = 3, sd = 20, unit = "um" }\n'
        'gap_sd = { family = "half_normal", sd = 3 }\n'
    )
    assert gear.priors["E0"].numbers == pytest.approx((210e3, 0.02))
    assert gear.priors["E0"].unit == "MPa"
    assert gear.priors["alpha"].numbers == pytest.approx((1e-4, 4e-4))
    assert gear.priors["force_offset"].numbers == pytest.approx((0.980665, 9.80665))
    assert gear.priors["deformation_offset"].numbers == pytest.approx((3e-3, 0.02))
    assert gear.scale_priors["gap_sd"].numbers == (3.0,)
    assert gear.priors["sigma"].numbers == rig_priors()["sigma"].numbers
    assert "some-gear.toml" in gear.priors["E0"].source


def test_effect_overrides_in_both_spellings(read):
    gear = read(
        "[priors]\n"
        '"slack.clearance" = { family = "half_normal", sd = 20, unit = "um" }\n'
        "[priors.coulomb_friction]\n"
        'force = { family = "half_normal", sd = 1.0 }\n'
        'slope = { family = "normal", mean = 0, sd = 2, unit = "N/degC" }\n'
    )
    assert gear.effect_priors["slack.clearance"].numbers == pytest.approx((0.02,))
    assert gear.effect_priors["coulomb_friction.force"].numbers == (1.0,)
    assert gear.effect_priors["coulomb_friction.slope"].unit == "N/K"


def test_what_the_prior_of_K_refers_to(read):
    own = '[priors]\nK = { family = "lognormal", median = 2, log_sd = 0.5 }\n'
    assert read('theory = "cup"\n').K_theory == "ring"
    assert read('theory = "cup"\n' + own).K_theory == "cup"
    overridden = read('theory = "cup"\n' + own, theory="article")
    assert (overridden.theory, overridden.K_theory) == ("article", "cup")


def test_a_material_of_ones_own(read, tmp_path):
    (tmp_path / "mine.toml").write_text(
        '[E0]\nfamily = "normal"\nmean = 70\nsd = 1\nunit = "GPa"\n'
        '[alpha]\nfamily = "fixed"\nvalue = 5\nunit = "1e-4/K"\n'
        '[poisson]\nfamily = "fixed"\nvalue = 0.33\n'
    )
    gear = read('material = "mine.toml"\n')
    assert gear.geometry.poisson == 0.33
    assert gear.priors["E0"].numbers == pytest.approx((70e3, 1e3))


def test_how_the_deformation_is_read_may_be_said_beside_a_silent_file():
    sizes = {"wall_thickness_mm": 0.68, "radius_mm": 40.0, "length_mm": 70.0}
    assert read_gear(sizes, reading="diametral").reading == "diametral"
    with pytest.raises(InputError, match="there is no 'round'"):
        read_gear(sizes, reading="round")
    with pytest.raises(InputError, match="the gear file says 'radial'"):
        read_gear(sizes | {"deformation": "radial"}, reading="diametral")
