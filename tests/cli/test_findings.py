"""A finding about a parameter is printed as one about the option."""

import pytest
from commands import XB1, Hdcal
from moving import still_posterior

from hdcal import InputError
from hdcal.calibration.calibrate import choose_effects
from hdcal.inference.sample import check_settings


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (["predict", "--deformation", "99"], "--deformation: 99 mm on a radius"),
        (["margin", "--deformation", "99"], "--deformation: 99 mm on a radius"),
        (["margin", "--deformation", ".4", "--content", "9"], "--content: 9 does"),
        (
            ["margin", "--deformation", ".4", "--tolerance", "size_mm=1"],
            "--tolerance: 'size_mm' is no size",
        ),
        (["design", "--window", ".4:.3"], "--window: 0.4:0.3 is empty"),
        (
            ["design", "--window", ".3:.4", "--spring-rate", "9:1"],
            "--spring-rate: 9:1 is no range",
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
            "--limit-force: no radius between 38 and 42 mm meets 9 N",
        ),
        (
            ["study", "--vary", "radius_mm=38", "--material", "stel"],
            "--material: unknown material 'stel'",
        ),
        (
            ["respond", "--force", "step", "--draws", "3"],
            "--draws: 3 does not lie between 20 and 10000:",
        ),
        (
            ["respond", "--force", "step", "--mass-kg", "-1"],
            "--mass-kg: -0.001 N·s²/mm does not lie",
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


def test_the_library_speaks_of_its_parameters():
    with pytest.raises(InputError) as short:
        check_settings(chains=1, warmup=0, draws=3, seed=-1)
    with pytest.raises(InputError) as unknown:
        choose_effects(["outlier"])
    named = [f.file for error in (short, unknown) for f in error.value.findings]
    assert named == ["chains", "warmup", "draws", "seed", "effects"]
