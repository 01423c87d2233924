"""`hdcal predict`: bands on the force from a result folder."""

from functools import partial

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.option_types import DEFORMATIONS, NUMBERS
from hdcal.cli.options import direction_option, force_option, json_option
from hdcal.quantities import FORCE

# By these columns --force knows an older table.
_COLUMNS = ("deformation_mm", "temperature_C", "direction", "physics_lo_N", "")


@command(short_help="Bands on the force from a result folder.")
@click.argument("run", metavar="RUN")
@click.option(
    "--deformation",
    type=DEFORMATIONS,
    required=True,
    help="Deformations as read [mm]: 0:0.6:61, or a list 0.1,0.2.",
)
@click.option(
    "--temperature",
    type=NUMBERS,
    help="Temperatures [°C]: 20,60 [default: the reference one].",
)
@direction_option(
    "Of the movement: deformation rising or falling [default: loading].", default=None
)
@click.option(
    "--out",
    metavar="FILE.csv",
    help="Write the table there instead of standard output.",
)
@force_option
@json_option
@click.pass_obj
def predict(console: Console, run, deformation, temperature, direction, out, force):
    """Predict the force with its bands from RUN.

    RUN is a folder of `hdcal calibrate` or `hdcal diagnose`; causes that the latter
    could not tell apart are averaged over by their probability.
    """
    from hdcal.inference.model_average import load_models
    from hdcal.prediction.engine.causes import averaging_words, causes_of
    from hdcal.report.saving import Target

    file = None
    with console.wrong as wrong:
        models = wrong.attempt(load_models, run)
        units = FORCE if models is None else causes_of(models)[0].posterior.case.units
        if out is not None:
            beginning = ",".join(map(units.key, _COLUMNS)).encode()
            file = console.hold(partial(Target, out, force, beginning=beginning))
    assert models is not None
    causes = causes_of(models)
    from hdcal.prediction.bands.bands import predict as bands_of
    from hdcal.prediction.bands.document import untested_rows
    from hdcal.prediction.bands.summary import prediction_answer
    from hdcal.report.table_files import columns_csv

    bands = bands_of(models, deformation, temperature, direction)
    untested = untested_rows(bands, causes[0].posterior.case.records)
    for words in (*averaging_words(causes), *filter(None, [untested])):
        console.words(words)
    table = columns_csv(bands.columns())
    if file is not None:
        with file.filled() as path:
            path.write_text(table, "utf-8")
        console.words(f"the table: {out}")
    elif not console.json:
        console.result(table.rstrip("\n"))
    if console.json:
        console.data(prediction_answer(bands, causes=causes))
    return 0
