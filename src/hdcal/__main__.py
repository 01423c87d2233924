"""The command line.

Heavy imports stay inside the commands, so that `hdcal --help` answers at once.
"""

import io
import os
import signal
import sys

import click
import platformdirs

from hdcal.calibration.check.command import check
from hdcal.calibration.command import calibrate
from hdcal.calibration.effects.command import effects
from hdcal.calibration.init.command import init
from hdcal.classical.command import fit
from hdcal.cli.console import Console, discard
from hdcal.cli.topics import show_topic
from hdcal.comparison.command import compare
from hdcal.design.command import design, study
from hdcal.diagnosis.command import diagnose
from hdcal.errors import Finding, HdcalError, InputError, NotUsable, ended
from hdcal.fleets.command import fleet
from hdcal.motion.command import respond
from hdcal.prediction.bands.command import predict
from hdcal.prediction.margin.command import margin
from hdcal.shared_causes.command import causes
from hdcal.tracking.command import track

DONE, NOT_TO_BE_USED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
# 128 + SIGPIPE, as shells report a program whose output is no longer read.
OUTPUT_CLOSED = 141
_EPILOG = "Exit codes: 0 done, 1 no usable result, 2 bad input, 130 interrupted."


@click.group(
    commands=[
        *(calibrate, diagnose, fleet, causes, compare, predict, margin, design, study),
        *(respond, track, fit, init, check, effects, show_topic),
    ],
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=_EPILOG,
)
@click.version_option(package_name="hdcal", message="hdcal %(version)s")
def hdcal() -> None:
    """Calibrate and diagnose the force model of a harmonic-drive flexspline.

    DATA or CASE is a file of measurements (CSV or .xlsx) with a gear file (--gear), or
    a folder with data.csv and gear.toml.
    """


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit; the exit code is the outcome."""
    given = sys.argv[1:] if arguments is None else arguments
    if "_HDCAL_COMPLETE" in os.environ:
        # Shell completion: click answers and exits.
        hdcal.main([], "hdcal")
    for name, value in _environment().items():
        os.environ.setdefault(name, value)
    console = Console(json="--json" in given)
    console.prepare()
    _handle_interrupts()
    code = _run(given, console)
    if code == INTERRUPTED and arguments is None:
        # Threads of XLA that are still running would crash the interpreter's exit.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    sys.exit(OUTPUT_CLOSED if code == DONE and console.unread else code)


def _run(arguments: list[str], console: Console) -> int:
    try:
        code = hdcal.main(arguments, "hdcal", standalone_mode=False, obj=console)
        return code if isinstance(code, int) else DONE
    except click.UsageError as error:
        if arguments:
            _usage_error(error, console)
        else:
            # The message is the help.
            console.findings([], _text(error))
        return BAD_INPUT
    except InputError as error:
        console.findings(error.findings)
        return BAD_INPUT
    except HdcalError as error:
        status = "failed" if isinstance(error, NotUsable) else "error"
        console.failure(status, str(error))
        return NOT_TO_BE_USED
    except (KeyboardInterrupt, click.Abort):
        console.words("interrupted")
        return INTERRUPTED
    except SystemExit:
        # Raised by click where the output is no longer read.
        return OUTPUT_CLOSED
    except Exception as error:
        if os.environ.get("HDCAL_DEBUG") == "1":
            raise
        what = " ".join(str(error).split())[:200]
        if isinstance(error, OSError):
            words = f"operating system error: {what}"
            if error.filename is None:
                # Standard output on a full disk.
                discard(sys.stdout)
        else:
            words = f"internal error ({type(error).__name__}: {what}); please report "
            words += "it with the output of HDCAL_DEBUG=1"
        console.failure("error", words)
        return NOT_TO_BE_USED


def _usage_error(error: click.UsageError, console: Console) -> None:
    """Print what is wrong with the command line, shortened."""
    command = error.ctx.command_path if error.ctx else "hdcal"
    problem = error.format_message().rstrip(".")
    found = Finding("command line", problem, f"See {command} --help")
    short = click.UsageError(ended(found.problem), error.ctx)
    console.findings([found], _text(short))


def _text(error: click.UsageError) -> str:
    """Return what click would print."""
    text = io.StringIO()
    error.show(text)
    return text.getvalue().rstrip()


def _environment() -> dict[str, str]:
    """Return variables that libraries read on import; the user's values have priority.

    Thousands of small steps take 35 times as long on an H200 as on one core.
    """
    folder = platformdirs.user_cache_dir("hdcal", False)
    return {
        "JAX_PLATFORMS": "cpu",
        "JAX_COMPILATION_CACHE_DIR": os.environ.get("HDCAL_CACHE_DIR", folder),
        "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
        "JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES": "-1",
        # JAX caches no program with callbacks that raise errors; NaN is checked for.
        "EQX_ON_ERROR": "nan",
        # A diagnosis solves thousands of systems too small for several threads.
        "OPENBLAS_NUM_THREADS": "1",
    }


def _handle_interrupts() -> None:
    """Clean up on SIGINT and SIGTERM, undisturbed by a second one."""
    signals = [signal.SIGTERM]
    # SIGINT is ignored in the background of a script and under nohup.
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signals.append(signal.SIGINT)

    def stop(*_) -> None:
        for each in signals:
            signal.signal(each, signal.SIG_IGN)
        raise KeyboardInterrupt

    for each in signals:
        signal.signal(each, stop)


if __name__ == "__main__":
    main()
