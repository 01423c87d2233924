"""A bad gear file is refused with every finding at its key."""

import pytest

from hdcal.data.gear import read_gear
from hdcal.data.reading import read_case
from hdcal.errors import InputError

SIZES = "wall_thickness_mm = 0.68\nradius_mm = 40.0\nlength_mm = 70.0\n"
GEAR = "[gear]\n" + SIZES
M = GEAR + "[measurement]\n"
P = GEAR + "[priors]\n"
# Text, and (key, words) of every finding.
CASES = {
    "empty": ("", [("gear", "missing")]),
    "no sizes": (
        "[gear]\n",
        [
            (f"gear.{size}_mm", "or use theory = 'spring'")
            for size in ("wall_thickness", "radius", "length")
        ],
    ),
    "four at once": (
        "[gear]\nwall_thicknes_mm = 1\nradius_mm = -4\nlength_mm = 70\n"
        'material = "stel"\n[measurement]\ndeformation = "radius"\n'
        "[priors]\nK = { family = 'normal', mean = 1 }\n",
        [
            ("gear.wall_thickness_mm", "missing"),
            ("gear.wall_thicknes_mm", "'wall_thickness_mm'"),
            ("gear.radius_mm", "-4 mm does not lie"),
            ("gear.material", "'steel'"),
            ("measurement.deformation", "'radial'"),
            ("priors.K.sd", "is missing"),
        ],
    ),
}
# Text, key and words of the only finding.
ONE = [
    (GEAR + "lenght_mm = 3\n", "gear.lenght_mm", "'length_mm'"),
    (GEAR + "[measurment]\n", "measurment", "'measurement'"),
    (
        GEAR.replace("0.68", "40.0"),
        "gear.wall_thickness_mm",
        "wall thickness is not less",
    ),
    (GEAR.replace("70.0", "nan"), "gear.length_mm", "finite"),
    (GEAR.replace("70.0", '"70"'), "gear.length_mm", "number"),
    (GEAR + 'material = "40CrNiMo"\n', "gear.material", "'40CrNiMoA'"),
    (GEAR + 'material = "my.toml"\n', None, "not exist"),
    (GEAR + 'theory = "cups"\n', "gear.theory", "'cup'"),
    (GEAR + "load_height_mm = 71\n", "gear.load_height_mm", "beyond the length"),
    (
        GEAR + "nominal_deformation_mm = 40\n",
        *("gear.nominal_deformation_mm", "less than the radius"),
    ),
    ("priors = 3\n" + GEAR, "priors", ""),
    (GEAR + "radius_mm = 3\n", None, "not valid TOML"),
    (GEAR + "name = " + "[" * 5000, None, "not valid TOML"),
    (GEAR + "[rig]\nfilter_Hz = inf\n", "rig.filter_Hz", "finite"),
    (P + "force_gain = { family = 'fixed', value = 1 }\n", "priors.force_gain", ""),
    (P + 'Eo = { family = "normal" }\n', "priors.Eo", "'E0'"),
    (P + "K = 2.0\n", "priors.K", "not a table"),
    (P + "K = { median = 2 }\n", "priors.K.family", "is missing"),
    (GEAR + "[priors.slack]\nclearance = 3\n", "priors.slack.clearance", "table"),
]
# Entry of [priors], key within it, and words.
ENTRIES = [
    ("K", "family = 'log-normal', median = 2, log_sd = 1", ".family", "'lognormal'"),
    ("K", "family = 'lognormal', median = 2", ".log_sd", "is missing"),
    ("K", "family = 'lognormal', median = 2, log_sd = 1, sd = 1", ".sd", "unknown key"),
    ("K", "family = 'uniform', low = 3, high = 2", ".high", "not less than"),
    ("sigma", "family = 'half_normal', sd = -1", ".sd", "not positive"),
    ("E0", "family = 'normal', mean = 207, sd = 3", "", "without a unit"),
    ("E0", "family = 'normal', mean = 7, sd = 3, unit = 'N'", ".unit", "not a unit"),
    ("slack.c", "family = 'half_normal', sd = 1, unit = 'mA'", ".unit", "not a unit"),
    ("K", "family = 'normal', mean = -2, sd = 1", ".mean", "does not lie"),
    ("E0", "family = 'normal', mean = 7, sd = 3, unit = '9**9'", ".unit", "not a unit"),
    ("noise_correlation", "family = 'uniform', low = -0.5, high = 0.5", ".low", "0"),
    ("noise_correlation", "family = 'fixed', value = 1.0", ".value", "below 1"),
    ("noise_correlation", "family = 'uniform', low = 0, high = 1.5", ".high", "1"),
    ("noise_correlation", "family = 'normal', mean = 0.3, sd = 0.3", ".family", "1"),
]
ONE += [
    (f"{P}{name} = {{ {entry} }}\n", f"priors.{name}{key}", words)
    for name, entry, key, words in ENTRIES
]
# Force certificate, key within it, and words.
CERTIFICATES = [
    ("", "", "states no uncertainty"),
    ("expanded_percnt = 1", ".expanded_percnt", "'expanded_percent'"),
    ("expanded_N = 1, k = 0.5", ".k", "does not lie"),
    ("expanded_percent = -1", ".expanded_percent", "does not lie"),
]
ONE += [
    (
        f"{M}force_calibration = {{ {stated} }}\n",
        *(f"measurement.force_calibration{key}", words),
    )
    for stated, key, words in CERTIFICATES
]
CASES |= {
    f"{place}: {where[0]}": (text, [where]) for place, (text, *where) in enumerate(ONE)
}


@pytest.mark.parametrize("name", CASES)
def test_every_finding_is_at_its_key(tmp_path, name):
    text, expected = CASES[name]
    path = tmp_path / "gear.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_gear(path)
    findings = caught.value.findings
    assert len(findings) == len(expected), [str(f) for f in findings]
    by_key = {f.column: f for f in findings}
    for key, words in expected:
        assert words in f"{by_key[key].problem}. {by_key[key].remedy}"


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        (b"\xff\xfe[gear]", "UTF-8"),
        (b"a = 1\n\0", "not valid TOML"),
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
