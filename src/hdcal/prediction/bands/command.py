"""`hdcal predict`: bands on the force from a result folder."""

import click

from hdcal.cli.compilation_cache import keep_compilations
from hdcal.cli.console import Console
from hdcal.cli.findings import options_named
from hdcal.cli.options import (
    direction_option,
    force_option,
    json_option,
    read_grid,
)

SCHEMA = "hdcal.prediction/1"


@click.command(short_help="Bands on the force from a result folder.")
@click.argument("run", metavar="RUN")
@click.option(
    "--deformation",
    required=True,
    metavar="START:STOP:COUNT",
    help="Deformations as read [mm]: 0:0.6:61, or a list 0.1,0.2.",
)
@click.option(
    "--temperature",
    metavar="LIST",
    help="Temperatures [°C]: 20,60 [default: the reference one].",
)
@direction_option
@click.option(
    "--out",
    metavar="FILE.csv",
    help="Write the table there instead of standard output.",
)
@force_option
@json_option
@click.pass_obj
def predict(console: Console, run, deformation, temperature, direction, out, force):
    """Predict the force with its bands from RUN, a folder of `hdcal calibrate`."""
    from hdcal.report.folder import check_file, write_whole

    along = read_grid(deformation, "--deformation")
    warmth = None if temperature is None else read_grid(temperature, "--temperature")
    if out is not None:
        check_file(out, force=force)
    keep_compilations()
    from hdcal.inference.posterior import Posterior
    from hdcal.prediction.bands.bands import predict as bands_of
    from hdcal.report.csv_table import columns_csv

    posterior = Posterior.load(run)
    with options_named():
        bands = bands_of(posterior, along, warmth, direction)
    untested = int((~bands.tested).sum())
    if untested:
        size = len(bands.tested)
        console.words(
            f"{untested} of {size} rows lie outside what was tested: "
            f"{_tested(posterior.case.records)}"
        )
    table = columns_csv(bands.columns())
    if out is not None:
        write_whole(out, table, force=force)
        console.words(f"the table: {out}")
    elif not console.json:
        console.result(table.rstrip("\n"))
    if console.json:
        columns = bands.columns()
        console.data(
            {"schema": SCHEMA, "status": "ok", "interval": 0.95, "columns": columns}
        )
    return 0


def _tested(records) -> str:
    """Say which deformations, temperatures and directions the data hold."""
    low, high = records.deformation.min(), records.deformation.max()
    cold, warm = records.temperature.min(), records.temperature.max()
    ways = {1.0: "up", -1.0: "down"}
    seen = " and ".join(way for sense, way in ways.items() if sense in records.sense)
    return f"{low:g} … {high:g} mm, {cold:g} … {warm:g} °C, {seen}"
