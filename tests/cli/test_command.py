"""A finding about a parameter of the library is said of what the user wrote."""

import click
import pytest

from hdcal.cli.command import command
from hdcal.errors import Finding, InputError


@pytest.mark.parametrize(
    ("parameter", "row", "shown"),
    [
        ("alarm_rows", None, "--alarm-rows"),
        ("known", None, "RUN"),
        ("data.csv", None, "data.csv"),
        ("known", 3, "known"),
    ],
)
def test_findings_name_options_and_arguments(parameter, row, shown):
    @command()
    @click.argument("known", metavar="[RUN]", required=False)
    @click.option("--alarm-rows", type=float)
    def asked(known, alarm_rows):
        raise InputError([Finding(parameter, "is wrong", "Mend it", row)])

    with pytest.raises(InputError) as caught:
        asked.main([], standalone_mode=False)
    assert [finding.file for finding in caught.value.findings] == [shown]


def test_parameters_within_the_words_are_options_too():
    @command()
    @click.option("--column", "columns", multiple=True)
    @click.option("--force", is_flag=True)
    def asked(columns, force):
        words = "`columns` force=… is wrong, as `hdcal check` says"
        raise InputError([Finding("data.csv", words, "Say `force` without `quick`")])

    with pytest.raises(InputError) as caught:
        asked.main([], standalone_mode=False)
    assert str(caught.value) == (
        "data.csv: --column force=… is wrong, as `hdcal check` says. "
        "Say --force without `quick`."
    )
