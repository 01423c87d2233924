"""`hdcal init`: write a case folder from the sizes of a gear."""

import os
from pathlib import Path

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.options import column_option, combined, json_option, sheet_option
from hdcal.data.theory_names import READINGS
from hdcal.errors import Finding, InputError

# Named as the keys of the gear file.
_sizes = combined(
    *(
        click.option(option, key, type=float, help=f"{words} [mm].")
        for option, key, words in (
            ("--wall", "wall_thickness_mm", "Wall thickness"),
            ("--radius", "radius_mm", "Radius to the middle of the wall"),
            ("--length", "length_mm", "Length of the gear"),
            ("--nominal", "nominal_deformation_mm", "Nominal deformation, as read"),
        )
    )
)
_NEEDED = ("wall_thickness_mm", "radius_mm", "length_mm", "deformation")


@command(short_help="Write a case folder from the sizes of a gear.")
@click.argument("folder", metavar="FOLDER")
@_sizes
@click.option("--material", default="steel", show_default=True, help="Material.")
@click.option(
    "--deformation",
    type=click.Choice(READINGS),
    help="Deformation as read, radial or diametral.",
)
@click.option(
    "--temperature",
    "reference_temperature_C",
    default=20.0,
    show_default=True,
    help="Reference temperature [°C].",
)
@click.option("--data", metavar="FILE", help="Copy these readings to FOLDER/data.csv.")
@column_option
@sheet_option
@json_option
@click.pass_obj
def init(console: Console, folder, data, columns, sheet, **stated):
    """Write FOLDER with a gear file, and with readings where there are any.

    All sizes but the nominal deformation, and --deformation, are required.
    """
    from hdcal.data.gear import read_gear
    from hdcal.data.gear_file.toml_file import gear_text
    from hdcal.data.measurements.gear_files import DATA_NAME, GEAR_NAME
    from hdcal.data.reading import read_case
    from hdcal.data.tables.sources import text_of

    given = {key: value for key, value in stated.items() if value is not None}
    missing = [key for key in _NEEDED if key not in given]
    if missing:
        raise InputError(Finding(key, "is missing", "State it") for key in missing)
    tables = {"name": Path(folder).resolve().name, **given}
    if str(tables["material"]).endswith(".toml"):
        # A gear file names another file relative to its folder.
        tables["material"] = os.path.abspath(str(tables["material"]))
    case = None
    with console.wrong:
        if data is None and sheet is not None:
            raise InputError(
                [Finding("--sheet", "needs a workbook", "Give it with --data")]
            )
        if data is None:
            console.wrong.attempt(read_gear, tables)
        elif Path(data).is_dir():
            raise InputError([Finding("data", "is a folder", "Give a file")])
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
        place = f"copy the readings to {DATA_NAME} in this folder"
        next_step = f"{place}, then run {next_step}"
    console.words(f"{', '.join(files)} written to {folder}. Next: {next_step}")
    if console.json:
        console.data({"status": "ok", "folder": folder, "files": [*files]})
    return 0


def _write(folder: Path, files: dict[str, bytes]) -> None:
    """Write new files into a folder that may be there already."""
    if there := [name for name in files if (folder / name).exists()]:
        words = f"already contains {' and '.join(there)}"
        raise InputError([Finding(str(folder), words, "Name another folder")])
    try:
        folder.mkdir(exist_ok=True)
        for name, content in files.items():
            (folder / name).write_bytes(content)
    except OSError as error:
        words = f"cannot be written ({error.strerror})"
        raise InputError([Finding(str(folder), words, "Name another folder")]) from None
