"""`hdcal track`: readings on standard input, stiffness and alarm on standard output."""

import sys

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console, discard_output
from hdcal.cli.options import json_option
from hdcal.errors import Finding, InputError


@command(short_help="Follow readings as they come, and call on a change.")
@click.argument("known", metavar="[RUN]", required=False)
@click.option(
    "--gear",
    metavar="GEAR.toml",
    help="Begin with a gear file's priors instead of a calibration.",
)
@click.option(
    "--alarm-rows",
    type=float,
    default=10_000.0,
    show_default=True,
    metavar="ROWS",
    help="Mean number of readings from one false alarm to the next.",
)
@click.option(
    "--forget",
    type=float,
    default=1.0,
    show_default=True,
    metavar="SHARE",
    help="Share of the past kept at each reading; 0.999 keeps about a thousand.",
)
@click.option(
    "--reopen",
    type=float,
    default=0.0,
    show_default=True,
    metavar="SHARE",
    help="After an alarm let the stiffness move by this share; 0.1 learns anew.",
)
@json_option
@click.pass_obj
def track(console: Console, known, gear, **settings):
    """Follow a gear reading by reading, from a calibration RUN or a gear file.

    Each line of standard input is a reading, such as {"deformation_mm": 0.2,
    "force_N": 37.8}, where known with temperature_C, time_s and run (a label of the
    mounting); or the first line is a header row such as deformation_mm,force_N, and the
    others are CSV. Each reading is answered at once by a line on standard output.
    """
    if (known is None) == (gear is None):
        remedy = "Name a result folder of hdcal calibrate, or --gear GEAR.toml"
        words = "needs either a calibration or a gear file, and not both"
        raise InputError([Finding("hdcal track", words, remedy)])
    from hdcal.cli.sources import load_gear, load_usable
    from hdcal.tracking.stream import answer_lines
    from hdcal.tracking.tracker import Tracker

    start = load_gear(gear) if known is None else load_usable(known)
    tracker, bad = Tracker(start, **settings), 0
    console.words(tracker.describe())
    try:
        bad = answer_lines(tracker, sys.stdin.buffer, sys.stdout)
    except KeyboardInterrupt:
        console.words(f"interrupted after {tracker.rows} rows")
        return 130
    except BrokenPipeError:
        console.unread = True
        discard_output()
    words = tracker.summary()
    console.words(words + (f"; lines that were no reading: {bad}" if bad else ""))
    return 2 if bad else 0
