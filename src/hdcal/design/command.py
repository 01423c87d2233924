"""`hdcal design`: the spring of a wave generator, or the sizes that keep a limit."""

import click

from hdcal.cli import options
from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.option_types import Parsed, read_window
from hdcal.design.options import (
    OF_LIMIT,
    OF_WINDOW,
    limit_options,
    question_findings,
    window_options,
)


@command(short_help="Wave generator for a window, or sizes for a limit.")
@options.start_options
@window_options
@limit_options
@click.option(
    "--temperature",
    "temperatures",
    type=Parsed("LO:HI", read_window),
    help="Temperatures at which it has to hold [°C] [default: the reference one].",
)
@click.option(
    "--probability", default=0.99, show_default=True, help="With which it has to hold."
)
@options.tolerance_option
@options.seed_option
@options.folder_options("Result folder [default: NAME-design].")
@options.json_option
@click.pass_obj
def design(console: Console, run, gear, out, force, **given):
    """Design from RUN, a folder of `hdcal calibrate`.

    With --window: the softest spring of an elastic wave generator that keeps the gear
    inside. With --limit-force: the sizes nearest to the tested ones that keep it.
    """
    from hdcal.design.inverse_design.inverse_design import inverse_design
    from hdcal.design.sources import open_source
    from hdcal.design.wave_generator.wave_generator import wave_generator

    with console.wrong as wrong:
        wrong += question_findings()
        source, usual = open_source(wrong, run, gear, "design")
        target = out or usual
        console.reserve_folder(target, force)
    assert source is not None and target is not None
    answer = wave_generator if given["window"] is not None else inverse_design
    for name in OF_LIMIT if answer is wave_generator else OF_WINDOW:
        del given[name]
    return console.show(answer(source, **given), answer="design.json")
