"""Every shipped prior is complete, sourced, and of a plausible size."""

import re

import pytest

from hdcal.data.gear import read_gear
from hdcal.data.prior import FAMILIES
from hdcal.data.priors import (
    material_names,
    material_priors,
)
from hdcal.errors import InputError


def test_materials_by_name():
    assert set(material_names()) == {
        "40CrNiMoA", "4340", "30CrMnSiA", "35CrMnSiA", "maraging300", "17-4PH",
        "15-5PH", "Ti-6Al-4V", "PEEK", "PA66-dry", "PA66-conditioned", "steel",
    }  # fmt: skip
    with pytest.raises(InputError, match="Did you mean 'maraging300'"):
        material_priors("maraging-300")


@pytest.mark.parametrize("name", material_names())
def test_a_material_is_plausible(name):
    found = material_priors(name)
    modulus, loss = found["E0"], found["alpha"]
    assert 1e3 < modulus.numbers[0] < 3e5
    assert modulus.unit == "MPa"
    assert 1e-4 < loss.numbers[0] < 1e-2
    assert loss.unit == "1/K"
    assert 0.2 < found["poisson"].numbers[0] < 0.45
    assert 1e-9 < found["density"].numbers[0] < 1e-8
    assert 5e-6 < found["cte"].numbers[0] < 2e-4
    for prior in found.values():
        assert prior.source.endswith("handbook value, deliberately wide")
        assert len(prior.numbers) == len(FAMILIES[prior.family])


CORRELATION = "[priors]\nnoise_correlation = {{ {} }}\n"
SIZES = "[gear]\nwall_thickness_mm = 0.68\nradius_mm = 40.0\nlength_mm = 70.0\n"


@pytest.mark.parametrize(
    "entry",
    [
        'family = "fixed", value = 0.0',
        'family = "fixed", value = 0.5',
        'family = "uniform", low = 0.0, high = 1.0',
        'family = "uniform", low = 0.2, high = 0.6',
        'family = "beta", a = 1.0, b = 3.0',
    ],
)
def test_a_correlation_may_be_none_known_or_a_share(tmp_path, entry: str):
    (tmp_path / "gear.toml").write_text(SIZES + CORRELATION.format(entry))
    prior = read_gear(tmp_path / "gear.toml").scale_priors["noise_correlation"]
    assert prior.family in entry


@pytest.mark.parametrize(
    ("entry", "number"),
    [
        ('family = "fixed", value = 1.0', "value"),
        ('family = "fixed", value = -0.1', "value"),
        ('family = "uniform", low = 0.0, high = 1.5', "high"),
        ('family = "uniform", low = -0.5, high = 0.5', "low"),
        ('family = "normal", mean = 0.3, sd = 0.3', "family"),
        ('family = "half_normal", sd = 0.3', "family"),
        ('family = "lognormal", median = 0.3, log_sd = 0.3', "family"),
    ],
)
def test_a_correlation_out_of_bounds_is_one_finding(tmp_path, entry, number):
    (tmp_path / "gear.toml").write_text(SIZES + CORRELATION.format(entry))
    with pytest.raises(InputError) as caught:
        read_gear(tmp_path / "gear.toml")
    (found,) = caught.value.findings
    assert found.column == f"priors.noise_correlation.{number}"
    assert re.search("0 (to below|and) 1", found.problem) and found.row == 6
    assert "gear.toml" in str(caught.value)
