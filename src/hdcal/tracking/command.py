"""`hdcal track`: readings on standard input, stiffness and alarm on standard output."""

import sys

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console, discard
from hdcal.cli.options import json_option


@command(short_help="Track readings as they arrive, with an alarm after a change.")
@click.argument("known", metavar="RUN")
@click.option(
    "--alarm-rows",
    default=10_000.0,
    show_default=True,
    metavar="ROWS",
    help="Set the mean number of readings between false alarms.",
)
@json_option
@click.pass_obj
def track(console: Console, known, alarm_rows):
    """Track a gear reading by reading, from RUN of `hdcal calibrate` or `diagnose`.

    Each line of standard input is a reading, such as {"deformation_mm": 0.2,
    "force_N": 37.8}, optionally with temperature_C and run (a label of the mounting).
    Each reading is answered at once by one line on standard output.
    """
    from hdcal.inference.model_average import load_models
    from hdcal.report.words import digits
    from hdcal.tracking.stream import answer_lines
    from hdcal.tracking.tracker import Tracker

    tracker, bad = Tracker(load_models(known), alarm_rows=alarm_rows), 0
    mean, half = tracker.stiffness
    words = (
        f"initial stiffness {digits(mean, 4)} ± {digits(half)} "
        f"{tracker.units.stiffness_unit} (95 %), for a new mounting; on average one "
        f"false alarm in {alarm_rows:g} readings"
    )
    console.words("\n".join([words, *tracker.notes]))
    try:
        bad = answer_lines(tracker, sys.stdin.buffer, sys.stdout)
    except KeyboardInterrupt:
        console.words(f"interrupted after {tracker.rows} rows")
        return 130
    except BrokenPipeError:
        console.unread = True
        discard(sys.stdout)
    due = tracker.readings / alarm_rows
    console.words(
        f"rows: {tracker.rows}, not readable: {bad}, alarms: {tracker.alarms}, false "
        f"alarms expected without a change: {digits(due)}"
    )
    if tracker.alarms:
        words = (
            "after a change the answers still refer to the gear before it, and alarms "
        )
        console.words(f"{words}are repeated: calibrate again")
    return 2 if bad else 0
