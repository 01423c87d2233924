"""`hdcal predict`: bands on the force from a result folder."""

from functools import partial

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.option_types import DEFORMATIONS, NUMBERS
from hdcal.cli.options import direction_option, force_option, json_option
from hdcal.quantities import FORCE

# By these columns --force recognises an older table.
_COLUMNS = ("deformation_mm", "temperature_C", "direction", "physics_lo_N", "")


@command(short_help="Predict the force with its bands.")
@click.argument("run", metavar="RUN")
@click.option(
    "--deformation",
    type=DEFORMATIONS,
    required=True,
    help="Predict at these deformations [mm] or angles [rad]: 0:0.6:61 or 0.1,0.2.",
)
@click.option(
    "--temperature",
    type=NUMBERS,
    help="Predict at these temperatures [°C]: 20,60 [default: the reference "
    "temperature].",
)
@direction_option(
    "Predict for increasing (up) or decreasing (down) deformation [default: the "
    "direction of loading].",
    default=None,
)
@click.option(
    "--out",
    metavar="FILE.csv",
    help="Write the table to FILE.csv instead of standard output.",
)
@force_option
@json_option
@click.pass_obj
def predict(console: Console, run, deformation, temperature, direction, out, force):
    """Predict the force with its bands from RUN.

    RUN is a result folder of `hdcal calibrate` or `hdcal diagnose`. Hypotheses of the
    diagnosis are averaged by their probability.
    """
    from hdcal.inference.model_average import load_models
    from hdcal.prediction.bands.predict import predict as bands_of
    from hdcal.prediction.models import model_pairs
    from hdcal.report.saving import Target
    from hdcal.report.table_files import columns_csv

    file = None
    with console.wrong as wrong:
        models = wrong.attempt(load_models, run)
        units = FORCE if models is None else model_pairs(models)[0][1].case.units
        if out is not None:
            beginning = ",".join(map(units.key, _COLUMNS)).encode()
            file = console.hold(partial(Target, out, force, beginning=beginning))
    assert models is not None
    bands = bands_of(models, deformation, temperature, direction)
    for words in bands.lines("notes"):
        console.words(words)
    table = columns_csv(dict(bands.to_frame()))
    if file is not None:
        with file.filled() as path:
            path.write_text(table, "utf-8")
        console.words(f"the table: {out}")
    elif not console.json:
        console.result(table.rstrip("\n"))
    if console.json:
        console.data(bands.to_dict())
    return 0
