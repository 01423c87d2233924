"""A finding about a parameter is printed as one about the option."""

import pytest
from commands import XB1, Hdcal
from moving import still_posterior

from hdcal import InputError
from hdcal.calibration.calibrate import choose_effects
from hdcal.data.measurements.measurements import read_measurements
from hdcal.errors import Finding
from hdcal.inference.sample import check_settings


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (["predict", "--deformation", "99"], "--deformation: 99 mm, where"),
        (["margin", "--deformation", "99"], "--deformation: 99 mm, where"),
        (["margin", "--deformation", ".4", "--content", "9"], "--content: 9 does"),
        (
            ["margin", "--deformation", ".4", "--tolerance", "size_mm=1"],
            "--tolerance: 'size_mm' is no size",
        ),
        (["design", "--window", ".4:.3"], "--window: 0.4:0.3 is empty"),
        (
            ["design", "--window", ".3:.4", "--spring-rate", "9:1"],
            "--spring-rate: 9:1 is empty",
        ),
        (
            ["design", "--window", ".3:.4", "--temperature=-300:0"],
            "--temperature: -300 °C does not lie between -273.15",
        ),
        (
            [
                *("design", "--limit-force", "9", "--vary", "radius_mm=38:42"),
                *("--probability", "0.9"),
            ],
            "--limit-force: nothing keeps 9 N",
        ),
        (
            ["study", "--vary", "radius_mm=38", "--material", "stel"],
            "stel.toml: unknown material",
        ),
        (
            ["respond", "--force", "step", "--draws", "3"],
            "--draws: 3 does not lie between 20 and 10000:",
        ),
        (
            ["respond", "--force", "step", "--mass-kg", "-1"],
            "--mass-kg: -1 kg does not lie between 1e-12 and 1000000000 kg:",
        ),
        (["respond", "--force", "step", "--amplitude", "0"], "--amplitude: 0 drives"),
    ],
)
def test_every_command_speaks_of_its_options(here: Hdcal, tmp_path, asked, words):
    still_posterior(K=0.02).save(tmp_path / "posterior.nc")
    done = here(asked[0], tmp_path, *asked[1:])
    assert done.returncode == 2, done.stderr
    assert f"hdcal: {words}" in " ".join(done.stderr.split())


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (["--chains", "1"], "--chains: 1 does not lie between 2 and 64:"),
        (["--draws", "3"], "--draws: 3 does not lie between 4 and 1000000:"),
        (["--effect", "outlier"], "--effect: no effect is called 'outlier'."),
    ],
)
def test_calibrate_speaks_of_its_options(here: Hdcal, asked, words):
    done = here("calibrate", XB1, *asked)
    assert done.returncode == 2, done.stderr
    assert f"hdcal: {words}" in " ".join(done.stderr.split())


@pytest.mark.parametrize(
    ("command", "asked"),
    [
        ("calibrate", ["--chains", "1", "--draws", "1", "--seed", "99999999999"]),
        ("diagnose", ["--jobs", "0", "--seed", "-1", "--library", "minus:none"]),
    ],
)
def test_every_number_that_cannot_be_is_said_at_once(here: Hdcal, command, asked):
    done = here(command, "no-case", *asked)
    assert done.returncode == 2
    for option in (*asked[::2], "no-case"):
        assert f"hdcal: {option}" in done.stderr, option
    assert "its unit" not in done.stderr


def test_the_library_speaks_of_its_parameters():
    with pytest.raises(InputError) as short:
        check_settings(chains=1, warmup=0, draws=3, seed=-1)
    with pytest.raises(InputError) as unknown:
        choose_effects(["outlier"])
    named = [f.file for error in (short, unknown) for f in error.value.findings]
    assert named == ["chains", "warmup", "draws", "seed", "effects"]


LONG = "x" * 50_000


def test_nothing_long_is_printed_whole(here: Hdcal, tmp_path):
    (tmp_path / "gear.toml").write_bytes((XB1 / "gear.toml").read_bytes())
    cells = f"deformation_mm,{LONG}\n{LONG},1\n" + "0,1\n" * 5
    (tmp_path / "data.csv").write_text(cells)
    asked = ["--column", f"force={LONG}", "--theory", "ring", "--json"]
    for arguments in (
        ["check", "data.csv", *asked],
        ["check", "data.csv", "--column", f"force={LONG}[{LONG}]", "--json"],
        ["check", LONG, "--json"],
        ["margin", ".", "--deformation", LONG],
        ["predict", ".", "--deformation", LONG],
        ["calibrate", "data.csv", "--effect", LONG],
    ):
        done = here(*arguments)
        assert done.returncode == 2, arguments[0]
        assert "x" * 20 in done.stderr
        assert "x" * 256 not in done.stderr
        assert max(map(len, done.stderr.splitlines())) < 2500


def test_a_gear_file_may_be_as_long(here: Hdcal, tmp_path):
    sizes = "wall_thickness_mm = 0.68\nradius_mm = 40\nlength_mm = 70\n"
    (tmp_path / "data.csv").write_bytes((XB1 / "data.csv").read_bytes())
    for line in (f'theory = "{LONG}"', f'material = "{LONG[:999]}"', f"{LONG} = 1"):
        (tmp_path / "gear.toml").write_text(f"[gear]\n{line}\n{sizes}")
        done = here("check", "data.csv")
        assert done.returncode == 2 and "x" * 20 in done.stderr
        assert "x" * 121 not in done.stderr


def test_a_note_is_as_short(here: Hdcal, tmp_path):
    (tmp_path / "gear.toml").write_bytes((XB1 / "gear.toml").read_bytes())
    rows = "".join(f"{i / 10},{10 * i},1\n" for i in range(6))
    (tmp_path / "data.csv").write_text(f"deformation_mm,force_N,{LONG}\n{rows}")
    done = here("check", "data.csv")
    assert done.returncode == 0 and "x" * 20 in done.stdout
    assert len(done.stdout + done.stderr) < 4000


def test_long_names_are_cut_in_their_middle():
    name = "begin" + LONG + "end"
    found = Finding("data.csv", f"'{name}' is the gear's", "Say it", 1, name)
    assert found.column is not None and len(found.column) == 121
    for text in (found.problem, found.column):
        assert "begin" in text and "end" in text and "…" in text
    assert len(str(found)) < 400
    kept = Finding("data.csv", "the gear's " + "word " * 40 + "file's", "Say it")
    assert kept.problem.endswith("file's") and "…" not in kept.problem
    assert len(Finding("a", LONG, LONG).problem) == 1001


def test_names_steer_no_terminal_and_begin_no_line(tmp_path):
    found = Finding("a\nb", "'\x1b[2J\n' is unknown", "Say \r", None, "c\td\u202e")
    assert str(found) == (r"a\nb, column 'c\td\u202e': '\x1b[2J\n' is unknown. Say \r.")
    (tmp_path / "data.csv").write_text("deformation_mm,force_N\n" + "0,\x1b[2J\n" * 5)
    with pytest.raises(InputError) as caught:
        read_measurements(tmp_path / "data.csv")
    assert r"'\x1b[2J' is not a number" in str(caught.value)
