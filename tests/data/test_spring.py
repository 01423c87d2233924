"""A spring: the theory without sizes, whose K is the stiffness itself."""

import math

import numpy as np
import pytest

from hdcal.data.full_scale import FullScale
from hdcal.data.gear import NO_MATERIAL, at_full_scale, read_gear
from hdcal.data.priors import rig_priors
from hdcal.data.reading import read_case
from hdcal.errors import InputError

SPRING = '[gear]\ntheory = "spring"\n'
SIZES = "wall_thickness_mm = 0.68\nradius_mm = 40\nlength_mm = 70.0\n"
STIFF = 'K = { family = "lognormal", median = 3.0, log_sd = 0.2, unit = "kN/mm" }\n'


@pytest.fixture
def read(tmp_path):
    def reader(text=SPRING, **given):
        path = tmp_path / "gear.toml"
        path.write_text(text)
        return read_gear(path, **given)

    return reader


@pytest.fixture
def rig(tmp_path):
    """A rig of 30 kN and 6 mm, one reading in fifty of which is zero."""
    (tmp_path / "gear.toml").write_text(SPRING)
    rows = "".join(f"{0.12 * i:.2f},{0.6 * i + 0.2 * (i % 3):.2f}\n" for i in range(51))
    (tmp_path / "data.csv").write_text("deformation_mm,force_kN\n" + rows)
    return read_case(tmp_path)


def findings(error):
    return [(f.column, f.problem) for f in error.value.findings]


def test_no_sizes_are_needed(read):
    gear = read()
    sizes = [getattr(gear.geometry, n) for n in ("wall_thickness", "radius", "length")]
    assert np.isnan([*sizes, gear.geometry.load_height, gear.geometry.poisson]).all()
    assert gear.reach == math.inf
    assert (gear.theory, gear.K_theory, gear.material) == (
        "spring",
        "spring",
        NO_MATERIAL,
    )
    shipped = rig_priors()
    assert gear.priors["E0"] == shipped["spring_modulus"]
    assert gear.priors["alpha"] == shipped["spring_alpha"]
    assert gear.priors["K"] == shipped["spring_stiffness"]


def test_other_theories_need_sizes(read):
    lacking = [f"gear.{name}_mm" for name in ("wall_thickness", "radius", "length")]
    for text, theory in (("[gear]\n", None), (SPRING, "cup")):
        with pytest.raises(InputError) as error:
            read(text, theory=theory)
        assert findings(error) == [(name, "is missing") for name in lacking]
        kept = ["keep the theory 'spring'" in f.remedy for f in error.value.findings]
        assert kept == [theory is not None] * 3
    assert read(SPRING + SIZES, theory="cup").K_theory == "ring"
    assert read("[gear]\n" + SIZES, theory="spring").K_theory == "spring"


def test_the_stiffness_is_that_of_the_readings(rig):
    middle, log_sd = rig.gear.priors["K"].numbers
    assert middle == pytest.approx(30.2e3 / 6.0, rel=0.05)
    assert log_sd == rig_priors()["spring_stiffness"].numbers[1]
    assert rig.gear.priors["sigma"].numbers[0] == pytest.approx(0.005 * 30e3, rel=0.05)


def test_a_stated_stiffness_stays(read):
    gear = read(SPRING + "[priors]\n" + STIFF)
    assert gear.priors["K"].numbers == pytest.approx((3000.0, 0.2))
    assert gear.priors["K"].unit == "N/mm"
    moved = at_full_scale(gear, FullScale(5.0, 0.01))
    assert moved.priors["K"] == gear.priors["K"]


@pytest.mark.parametrize("scale", [FullScale(1e9, 1e-6), FullScale(1e-9, 1e6)])
def test_the_stiffness_keeps_to_its_range(read, scale):
    middle = at_full_scale(read(), scale).priors["K"].numbers[0]
    assert 1e-12 <= middle <= 1e12


def test_a_spring_has_no_modulus(read):
    with pytest.raises(InputError) as error:
        read(
            SPRING + "[priors]\n"
            'E0 = { family = "normal", mean = 200.0, sd = 5.0, unit = "GPa" }\n'
        )
    ((column, problem),) = findings(error)
    assert column == "priors.E0"
    assert "has no meaning" in problem
