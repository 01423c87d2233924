"""The command line: read, call, write.

Heavy imports stay inside the commands, so that `hdcal --help` answers at once.
"""

import os
import signal
import sys

import click

from hdcal.blind.command.command import blind
from hdcal.calibration.check.command import check
from hdcal.calibration.command import calibrate
from hdcal.calibration.effects.command import effects
from hdcal.classical.audit.command import audit
from hdcal.classical.fit.command import fit
from hdcal.cli.console import Console, usage_error
from hdcal.design.command.command import design
from hdcal.design.study.command import study
from hdcal.diagnosis.command import diagnose
from hdcal.errors import HdcalError, InputError, NotUsable
from hdcal.motion.respond.command import respond
from hdcal.prediction.bands.command import predict
from hdcal.prediction.margin.command import margin
from hdcal.tracking.command import track

DONE, NOT_TO_BE_USED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130


def _show_version(context: click.Context, _, wanted: bool) -> None:
    if wanted and not context.resilient_parsing:
        from importlib.metadata import version

        click.echo(f"hdcal {version('hdcal')}")
        context.exit()


_EPILOG = (
    "Exit codes: 0 done, 1 no result that may be used, 2 bad input, 130 interrupted."
)


@click.group(context_settings={"help_option_names": ["-h", "--help"]}, epilog=_EPILOG)
@click.option(
    "--version",
    is_flag=True,
    expose_value=False,
    is_eager=True,
    callback=_show_version,
    help="Show the version and stop.",
)
def hdcal() -> None:
    """Calibrate the force model of a harmonic-drive flexspline, and say what it lacks.

    DATA and CASE are a CSV file of measurements with a gear file (--gear), or a folder
    holding data.csv and gear.toml.
    """


for _command in (
    calibrate,
    diagnose,
    predict,
    margin,
    design,
    study,
    respond,
    track,
    fit,
    check,
    effects,
    audit,
    blind,
):
    hdcal.add_command(_command)


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; every outcome is an exit code and plain words."""
    given = sys.argv[1:] if arguments is None else arguments
    console = Console(json="--json" in given)
    console.prepare()
    _hear_termination()
    sys.exit(_run(given, console))


def _run(arguments: list[str], console: Console) -> int:
    try:
        code = hdcal.main(arguments, "hdcal", standalone_mode=False, obj=console)
        return code if isinstance(code, int) else DONE
    except click.UsageError as error:
        console.findings([usage_error(error)], error.show)
        return BAD_INPUT
    except InputError as error:
        console.findings(error.findings)
        return BAD_INPUT
    except NotUsable as error:
        console.failure("failed", str(error))
        return NOT_TO_BE_USED
    except HdcalError as error:
        console.failure("error", str(error))
        return NOT_TO_BE_USED
    except (KeyboardInterrupt, click.Abort):
        console.words("interrupted: nothing was written")
        return INTERRUPTED
    except Exception as error:
        return _internal(error, console)


def _internal(error: Exception, console: Console) -> int:
    if os.environ.get("HDCAL_DEBUG") == "1":
        raise error
    what = " ".join(str(error).split())[:200] or "no further words"
    console.failure(
        "error",
        f"internal error ({type(error).__name__}: {what}); please report it, with "
        "what HDCAL_DEBUG=1 prints",
    )
    return NOT_TO_BE_USED


def _hear_termination() -> None:
    """Clean up on SIGTERM as on an interruption."""

    def stop(*_) -> None:
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, stop)


if __name__ == "__main__":
    main()
