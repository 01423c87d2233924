"""`hdcal track`: readings on standard input, stiffness and alarm on standard output."""

import contextlib
import json
import os
import sys

import click

from hdcal.cli.console import Console
from hdcal.cli.options import json_option
from hdcal.errors import Finding, InputError


@click.command(short_help="Follow readings as they come, and call on a change.")
@click.argument("run", metavar="[RUN]", required=False)
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
def track(console: Console, run, gear, **settings):
    """Follow a gear reading by reading, from a calibration RUN or a gear file.

    Each line of standard input is a reading, such as {"deformation_mm": 0.2,
    "force_N": 37.8}, where known with temperature_C, time_s and run (a label of the
    mounting). Each is answered at once by a line on standard output.
    """
    if (run is None) == (gear is None):
        remedy = "Name a result folder of hdcal calibrate, or --gear GEAR.toml"
        words = "needs either a calibration or a gear file, and not both"
        raise InputError([Finding("hdcal track", words, remedy)])
    tracker = _begin(run, gear, settings)
    console.words(tracker.describe())
    bad = 0
    try:
        bad = _follow(tracker)
    except KeyboardInterrupt:
        console.words(f"interrupted after {tracker.rows} rows")
        return 130
    except BrokenPipeError:
        # Nobody reads any more. Python would complain again when it flushes.
        with contextlib.suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    words = f"{tracker.rows} rows, {tracker.alarms} alarms"
    console.words(words + (f", {bad} rows that were no reading" if bad else ""))
    return 2 if bad else 0


def _begin(run, gear, settings: dict):
    from hdcal.cli.compilation_cache import keep_compilations

    keep_compilations()
    from hdcal.tracking.tracker import Tracker

    if gear is not None:
        from hdcal.data.gear import read_gear

        return Tracker(read_gear(gear), **settings)
    from hdcal.inference.posterior import Posterior

    return Tracker(Posterior.load(run), **settings)


def _follow(tracker) -> int:
    """Answer line by line, each at once; return how many were no reading."""
    from hdcal.tracking.stream import answers

    bad, out = 0, sys.stdout
    for answer in answers(tracker, sys.stdin.buffer):
        bad += answer["status"] == "error"
        out.write(json.dumps(answer, allow_nan=False) + "\n")
        out.flush()
    return bad
