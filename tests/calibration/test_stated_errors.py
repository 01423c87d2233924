"""`hdcal check` shows what certificates state, and that `force_sd` is no gain."""

import json

import pytest

SIZES = "[gear]\nwall_thickness_mm = 0.68\nradius_mm = 40.0\nlength_mm = 70.0\n"
STATED_BY = """[measurement]
force_calibration = { iso376_class = "0.5", expanded_N = 0.3, k = 3 }
deformation_calibration = { expanded_percent = 0.2, expanded_mm = 0.004 }
temperature_calibration = { expanded_K = 1.0 }
"""


@pytest.fixture
def folder(tmp_path):
    rows = "".join(f"{i / 10},{20 * i},0.2\n" for i in range(6))
    (tmp_path / "data.csv").write_text("deformation_mm,force_N,force_sd_N\n" + rows)
    return tmp_path


def test_each_certificate_is_shown_as_a_standard_uncertainty(folder, here):
    (folder / "gear.toml").write_text(SIZES + STATED_BY)
    answer = json.loads(here("check", folder, "--json").stdout)
    found = {one["parameter"]: one for one in answer["certificates"]}
    sizes = {n: (one["standard_uncertainty"], one["unit"]) for n, one in found.items()}
    assert sizes == {
        "force_gain": (pytest.approx(0.09), "%"),
        "deformation_gain": (pytest.approx(0.1), "%"),
        "temperature_offset": (0.5, "K"),
        "force_offset": (pytest.approx(0.1), "N"),
        "deformation_offset": (0.002, "mm"),
    }
    source = found["force_gain"]["certificate"]
    assert source == "certificate: iso376_class = 0.5, k = 2"
    words = " ".join(here("check", folder).stdout.split())
    for name in found:
        assert name in words and found[name]["words"]
    assert any(note.startswith("force_sd is") for note in answer["notes"])


def test_a_prior_of_the_gear_file_replaces_a_certificate(folder, here):
    prior = '[priors]\nforce_offset = { family = "fixed", value = 0.0 }\n'
    (folder / "gear.toml").write_text(SIZES + STATED_BY + prior)
    answer = json.loads(here("check", folder, "--json").stdout)
    names = {one["parameter"] for one in answer["certificates"]}
    assert "deformation_offset" in names and "force_offset" not in names


def test_without_certificates_none_are_shown(folder, here):
    rows = "".join(f"{i / 10},{20 * i}\n" for i in range(6))
    (folder / "data.csv").write_text("deformation_mm,force_N\n" + rows)
    (folder / "gear.toml").write_text(SIZES)
    answer = json.loads(here("check", folder, "--json").stdout)
    assert answer["certificates"] == []
    assert not any("force_sd" in note for note in answer["notes"])
