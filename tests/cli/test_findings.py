"""A finding about a parameter is printed as one about the option."""

import click
import pytest
from click.testing import CliRunner
from commands import Hdcal
from moving import still_posterior

from hdcal.cli.findings import options_named
from hdcal.errors import Finding, InputError


@pytest.mark.parametrize(
    ("named", "printed"),
    [
        ("limit_force", "--limit-force"),
        # Click's own name of an option, and another than either.
        ("drive", "--force"),
        ("force", "--force"),
        ("rates", "--spring-rate"),
        # No option of this command.
        ("run", "run"),
        ("gear.toml", "gear.toml"),
        ("confidence", "confidence"),
    ],
)
def test_a_parameter_is_called_by_its_option(named: str, printed: str):
    caught = []

    @click.command()
    @click.argument("run")
    @click.option("--limit-force", "-l")
    @click.option("--force", "drive")
    @click.option("--spring-rate")
    def command(**_):
        try:
            with options_named(rates="--spring-rate"):
                raise InputError([Finding(named, "is wrong", "mend it", row=3)])
        except InputError as error:
            caught.extend(error.findings)

    assert CliRunner().invoke(command, ["run"]).exit_code == 0
    assert caught == [Finding(printed, "is wrong", "mend it", row=3)]


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
            "--temperature: is below absolute zero",
        ),
        (
            ["design", "--limit-force", "9", "--vary", "radius_mm=38:42"],
            "--limit-force: no radius between 38 and 42 mm meets 9 N",
        ),
        (
            ["study", "--vary", "radius_mm=38", "--material", "stel"],
            "--material: unknown material 'stel'",
        ),
        (["respond", "--force", "step", "--draws", "3"], "--draws: 3 is no usable"),
        (["respond", "--force", "step", "--mass-kg", "-1"], "--mass-kg: -1 kg is no"),
        (["respond", "--force", "step", "--amplitude", "0"], "--amplitude: 0 drives"),
    ],
)
def test_every_command_speaks_of_its_options(here: Hdcal, tmp_path, asked, words):
    still_posterior(K=0.02).save(tmp_path / "posterior.nc")
    done = here(asked[0], tmp_path, *asked[1:])
    assert done.returncode == 2, done.stderr
    assert f"hdcal: {words}" in " ".join(done.stderr.split())
