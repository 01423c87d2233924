"""A finding about a parameter of the library is printed as one about the option."""

import pytest
from commands import XB1, Hdcal
from moving import still_posterior

from hdcal.data.measurements.measurements import read_measurements
from hdcal.errors import Finding, InputError

LONG = "x" * 50_000


@pytest.mark.parametrize(
    ("asked", "option"),
    [
        (["predict", "--deformation", "99"], "--deformation"),
        (["margin", "--deformation", ".4", "--content", "9"], "--content"),
        (["design", "--window", ".4:.3"], "--window"),
        (["design", "--window", ".3:.4", "--temperature=-300:0"], "--temperature"),
        (["study", "--vary", "wall_thickness_mm=60"], "--vary"),
        (["respond", "--force", "step", "--draws", "3"], "--draws"),
        (["respond", "--force", "step", "--mass-kg", "-1"], "--mass-kg"),
        (["calibrate", "--chains", "1"], "--chains"),
        (["calibrate", "--effect", "outlier"], "--effect"),
    ],
)
def test_every_command_names_its_options(here: Hdcal, tmp_path, asked, option):
    name, *options = asked
    still_posterior(K=0.02).save(tmp_path / "posterior.nc")
    done = here(name, XB1 if name == "calibrate" else tmp_path, *options)
    assert done.returncode == 2, done.stderr
    assert f"hdcal: {option}: " in " ".join(done.stderr.split())


def test_every_wrong_number_is_reported_at_once(here: Hdcal):
    asked = ["--chains", "1", "--draws", "1", "--seed", "99999999999"]
    done = here("calibrate", "no-case", *asked)
    assert done.returncode == 2
    for name in (*asked[::2], "no-case"):
        assert f"hdcal: {name}" in done.stderr, name


def test_long_input_is_shortened_in_messages(here: Hdcal, tmp_path):
    (tmp_path / "gear.toml").write_bytes((XB1 / "gear.toml").read_bytes())
    cells = f"deformation_mm,{LONG}\n{LONG},1\n" + "0,1\n" * 5
    (tmp_path / "data.csv").write_text(cells)
    for arguments in (
        ["check", "data.csv", "--column", f"force={LONG}[{LONG}]", "--json"],
        ["check", LONG, "--json"],
        ["margin", ".", "--deformation", LONG],
        ["calibrate", "data.csv", "--effect", LONG],
    ):
        done = here(*arguments)
        assert done.returncode == 2, arguments[0]
        assert "x" * 20 in done.stderr and "x" * 256 not in done.stderr


def test_findings_escape_control_characters_and_cut_in_the_middle(tmp_path):
    found = Finding("a\nb", "'\x1b[2J\n' is unknown", "Say \r", None, "c\td\u202e")
    assert str(found) == (r"a\nb, column 'c\td\u202e': '\x1b[2J\n' is unknown. Say \r.")
    name = "begin" + LONG + "end"
    found = Finding("data.csv", f"'{name}' is wrong", "Say it", 1, name)
    assert found.column is not None and len(found.column) == 121
    for text in (found.problem, found.column):
        assert "begin" in text and "end" in text and len(text) < 150
    (tmp_path / "data.csv").write_text("deformation_mm,force_N\n" + "0,\x1b[2J\n" * 5)
    with pytest.raises(InputError) as caught:
        read_measurements(tmp_path / "data.csv")
    assert r"'\x1b[2J' is not a number" in str(caught.value)
