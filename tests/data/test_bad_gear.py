"""A bad gear file is refused with every finding at its key."""

import pytest

from hdcal.data.gear import read_gear
from hdcal.data.reading import read_case
from hdcal.errors import InputError

SIZES = "wall_thickness_mm = 0.68\nradius_mm = 40.0\nlength_mm = 70.0\n"
GEAR = "[gear]\n" + SIZES
P = GEAR + "[priors]\n"

# text, (row, key, words) of every finding
CASES = {
    "empty": ("", [(None, "gear", "missing")]),
    "no sizes": (
        "[gear]\n",
        [
            (1, f"gear.{s}_mm", "or take the theory 'spring'")
            for s in ("wall_thickness", "radius", "length")
        ],
    ),
    "unknown key": (GEAR + "lenght_mm = 3\n", [(5, "gear.lenght_mm", "'length_mm'")]),
    "unknown table": (GEAR + "[measurment]\n", [(5, "measurment", "'measurement'")]),
    "wall too thick": (
        GEAR.replace("0.68", "40.0"),
        [(2, "gear.wall_thickness_mm", "not thinner")],
    ),
    "negative": (
        GEAR.replace("0.68", "-1"),
        [(2, "gear.wall_thickness_mm", "-1 mm does not lie")],
    ),
    "nan": (GEAR.replace("70.0", "nan"), [(4, "gear.length_mm", "finite")]),
    "text": (GEAR.replace("70.0", '"70"'), [(4, "gear.length_mm", "number")]),
    "metres": (GEAR.replace("70.0", "1e9"), [(4, "gear.length_mm", "does not lie")]),
    "material": (
        GEAR + 'material = "40CrNiMo"\n',
        [(5, "gear.material", "'40CrNiMoA'")],
    ),
    "material file": (GEAR + 'material = "my.toml"\n', [(None, None, "not exist")]),
    "theory": (GEAR + 'theory = "cups"\n', [(5, "gear.theory", "'cup'")]),
    "load height": (
        GEAR + "load_height_mm = 71\n",
        [(5, "gear.load_height_mm", "beyond the length")],
    ),
    "nominal": (
        GEAR + "nominal_deformation_mm = 40\n",
        [(5, "gear.nominal_deformation_mm", "below the radius")],
    ),
    "reading": (
        GEAR + '[measurement]\ndeformation = "diameter"\n',
        [(6, "measurement.deformation", "'diametral'")],
    ),
    "priors is a number": ("priors = 3\n" + GEAR, [(1, "priors", "")]),
    "prior unknown": (
        P + 'Eo = { family = "normal" }\n',
        [(6, "priors.Eo", "'E0'")],
    ),
    "no family": (P + "K = { median = 2 }\n", [(6, "priors.K.family", "is missing")]),
    "family": (
        P + 'K = { family = "log-normal", median = 2, log_sd = 1 }\n',
        [(6, "priors.K.family", "'lognormal'")],
    ),
    "number missing": (
        P + 'K = { family = "lognormal", median = 2 }\n',
        [(6, "priors.K.log_sd", "is missing")],
    ),
    "number extra": (
        P + 'K = { family = "lognormal", median = 2, log_sd = 1, sd = 1 }\n',
        [(6, "priors.K.sd", "unknown key")],
    ),
    "sd negative": (
        P + 'force_offset = { family = "normal", mean = 0, sd = -1 }\n',
        [(6, "priors.force_offset.sd", "not positive")],
    ),
    "low above high": (
        P + 'K = { family = "uniform", low = 3, high = 2 }\n',
        [(6, "priors.K.high", "not below")],
    ),
    "K negative": (
        P + 'K = { family = "normal", mean = -2, sd = 1 }\n',
        [(6, "priors.K.mean", "does not lie")],
    ),
    "no unit": (
        P + 'E0 = { family = "normal", mean = 207, sd = 3 }\n',
        [(6, "priors.E0", "without a unit")],
    ),
    "wrong dimension": (
        P + 'E0 = { family = "normal", mean = 207, sd = 3, unit = "N" }\n',
        [(6, "priors.E0.unit", "does not measure")],
    ),
    "unit is a sum": (
        P + 'E0 = { family = "normal", mean = 1, sd = 1, unit = "9**9**9**9" }\n',
        [(6, "priors.E0.unit", "not a unit")],
    ),
    "effect unit": (
        GEAR + "[priors.slack]\nc = { family = 'half_normal', sd = 1, unit = 'mA' }\n",
        [(6, "priors.slack.c.unit", "is not a unit")],
    ),
    "duplicate key": (GEAR + "radius_mm = 3\n", [(5, None, "not TOML")]),
    "deep": (GEAR + "name = " + "[" * 5000, [(None, None, "not TOML")]),
    "four at once": (
        "[gear]\nwall_thicknes_mm = 1\nradius_mm = -4\nlength_mm = 70\n"
        'material = "stel"\n[measurement]\ndeformation = "radius"\n'
        "[priors]\nK = { family = 'normal', mean = 1 }\n",
        [
            (1, "gear.wall_thickness_mm", "missing"),
            (2, "gear.wall_thicknes_mm", "'wall_thickness_mm'"),
            (3, "gear.radius_mm", "-4 mm does not lie"),
            (5, "gear.material", "'steel'"),
            (7, "measurement.deformation", "'radial'"),
            (9, "priors.K.sd", "is missing"),
        ],
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_bad_gear(tmp_path, name):
    text, expected = CASES[name]
    path = tmp_path / "gear.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_gear(path)
    findings = caught.value.findings
    assert len(findings) == len(expected), [str(f) for f in findings]
    found = {f.column: f for f in findings}
    for row, key, words in expected:
        assert found[key].row == row
        assert words in f"{found[key].problem}. {found[key].remedy}"


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        (b"\xff\xfe[gear]", "UTF-8"),
        (b"a = 1\n\0", "not TOML"),
        (b"#" * (1 << 21), "larger than 1 MiB"),
    ],
)
def test_not_a_toml(tmp_path, raw, words):
    (tmp_path / "gear.toml").write_bytes(raw)
    with pytest.raises(InputError, match=words):
        read_gear(tmp_path / "gear.toml")


def test_table_and_gear_are_reported_together(folder):
    (folder / "data.csv").write_text("deformation_mm\n1\n2\n3\n4\n5\n")
    (folder / "gear.toml").write_text("[gear]\nwall_thickness_mm = 0\n")
    with pytest.raises(InputError) as caught:
        read_case(folder)
    files = [f.file.rpartition("/")[2] for f in caught.value.findings]
    assert files == ["data.csv"] + ["gear.toml"] * 3


def test_theory_of_the_command_line(folder):
    with pytest.raises(InputError, match="Did you mean 'article'"):
        read_case(folder, theory="artikel")
