"""`hdcal init`: ask for what a gear file needs, and write a case folder."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.options import column_option, json_option, sheet_option
from hdcal.data.theory_names import READINGS
from hdcal.errors import Finding, InputError

# Parameter -> its key in the gear file, its option, what is asked, the usual answer.
_ASKED: dict[str, tuple[str, str, str, str | float | None]] = {
    "wall_thickness": ("wall_thickness_mm", "--wall", "Wall thickness [mm]", None),
    "radius": ("radius_mm", "--radius", "Radius to the middle of the wall [mm]", None),
    "length": ("length_mm", "--length", "Length of the gear [mm]", None),
    "material": ("material", "--material", "Material", "steel"),
    "reading": (
        "deformation",
        "--deformation",
        "Deformation as read, radial or diametral",
        None,
    ),
    "reference_temperature": (
        "reference_temperature_C",
        "--temperature",
        "Reference temperature [°C]",
        20.0,
    ),
}
_KIND = dict.fromkeys(_ASKED, click.FLOAT) | {
    "material": click.STRING,
    "reading": click.Choice(READINGS),
}


def _asked(command):
    for name, (_, option, words, default) in reversed(_ASKED.items()):
        usual = "" if default is None else f" [default: {default}]"
        add = click.option(option, name, type=_KIND[name], help=f"{words}{usual}.")
        command = add(command)
    return command


@command(short_help="Write a case folder from the sizes of a gear.")
@click.argument("folder", metavar="FOLDER")
@_asked
@click.option("--data", metavar="FILE", help="Copy these readings to FOLDER/data.csv.")
@column_option
@sheet_option
@json_option
@click.pass_obj
def init(console: Console, folder, data, columns, sheet, **given):
    """Write FOLDER with a gear file, from options or answers to questions."""
    stated = dict(_answers(given))
    from hdcal.data.gear import read_gear
    from hdcal.data.gear_file.toml_file import gear_text
    from hdcal.data.measurements.gear_files import DATA_NAME, GEAR_NAME
    from hdcal.data.reading import read_case
    from hdcal.data.tables.sources import text_of

    tables = {"name": Path(folder).resolve().name, **stated}
    if str(tables["material"]).endswith(".toml"):
        # A gear file names another file relative to its folder.
        tables["material"] = os.path.abspath(str(tables["material"]))
    case = None
    with console.wrong:
        if data is None and sheet is not None:
            raise InputError(
                [Finding("--sheet", "is of a workbook", "Name its --data")]
            )
        if data is None:
            console.wrong.attempt(read_gear, tables)
        elif Path(data).is_dir():
            raise InputError([Finding("data", "is a folder", "Name a file")])
        elif columns is not None:
            how = {"columns": columns, "sheet": sheet}
            case = console.wrong.attempt(read_case, data, tables, **how)
    measured = {
        key: tables.pop(key) for key in ("deformation", "reference_temperature_C")
    }
    columns = columns or {} if case is None else case.columns
    text = gear_text({"gear": tables, "measurement": measured, "columns": columns})
    files = {GEAR_NAME: text.encode()}
    if data is not None:
        files[DATA_NAME] = text_of(Path(data), sheet)
    _write(Path(folder), files)
    several = case is not None and len(case.specimen_labels) > 1
    next_step = f"hdcal {'fleet' if several else 'calibrate'} {folder} --out result"
    if data is None:
        next_step = f"put your readings there as {DATA_NAME}, then {next_step}"
    console.words(f"{', '.join(files)} written into {folder}. Next: {next_step}")
    if console.json:
        console.data({"status": "ok", "folder": folder, "files": [*files]})
    return 0


def _answers(given: dict) -> Iterator[tuple[str, str | float]]:
    """Yield what is stated, asking for what is not on a terminal.

    Raises:
        InputError: something has no usual answer, and nobody can be asked.
    """
    terminal = sys.stdin is not None and sys.stdin.isatty()
    missing = [
        Finding(option, "is not stated", "State it, or call hdcal from a terminal")
        for name, (_, option, _, default) in _ASKED.items()
        if given[name] is None and default is None and not terminal
    ]
    if missing:
        raise InputError(missing)
    for name, (key, _, words, default) in _ASKED.items():
        if given[name] is not None:
            yield key, given[name]
        elif not terminal:
            assert default is not None
            yield key, default
        else:
            yield key, click.prompt(words, default=default, type=_KIND[name], err=True)


def _write(folder: Path, files: dict[str, bytes]) -> None:
    """Write files into a folder that may be there already; none of theirs is replaced.

    Raises:
        InputError: one of them is there already, or cannot be written.
    """
    if there := [name for name in files if (folder / name).exists()]:
        words = f"holds {' and '.join(there)} already"
        raise InputError([Finding(str(folder), words, "Name another folder")])
    try:
        folder.mkdir(exist_ok=True)
        for name, content in files.items():
            (folder / name).write_bytes(content)
    except OSError as error:
        words = f"cannot be written ({error.strerror})"
        raise InputError([Finding(str(folder), words, "Name another folder")]) from None
