"""The command line: read, call, write.

Heavy imports stay inside the commands, so that `hdcal --help` answers at once.
"""

import os
import signal
import sys
from collections.abc import Iterator
from functools import partial

import click
import platformdirs

from hdcal.calibration.check.command import check
from hdcal.calibration.command import calibrate
from hdcal.calibration.effects.command import effects
from hdcal.calibration.init.command import init
from hdcal.classical.command import fit
from hdcal.cli.console import Console, discard_output, usage_error
from hdcal.cli.topics import show_topic
from hdcal.comparison.command import compare
from hdcal.design.command import design, study
from hdcal.diagnosis.command import diagnose
from hdcal.errors import Finding, HdcalError, InputError, NotUsable, ended
from hdcal.fleets.command import fleet, margin
from hdcal.motion.command import respond
from hdcal.prediction.bands.command import predict
from hdcal.shared_causes.command import causes
from hdcal.tracking.command import track

DONE, NOT_TO_BE_USED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
# 128 + SIGPIPE, as shells report a tool whose reader is gone.
NOBODY_READS = 141


def _show_version(context: click.Context, _, wanted: bool) -> None:
    if wanted and not context.resilient_parsing:
        from importlib.metadata import version

        click.echo(f"hdcal {version('hdcal')}")
        context.exit()


_EPILOG = (
    "Exit codes: 0 done, 1 no result that may be used, 2 bad input, 130 interrupted."
)


@click.group(
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=_EPILOG,
)
@click.option(
    "--version",
    is_flag=True,
    expose_value=False,
    is_eager=True,
    callback=_show_version,
    help="Show the version and stop.",
)
def hdcal() -> None:
    """Calibrate the force model of a harmonic-drive flexspline and diagnose its gaps.

    DATA and CASE are a file of measurements (CSV, or .xlsx) with a gear file (--gear),
    or a folder holding data.csv and gear.toml.
    """


for _command in (
    calibrate,
    diagnose,
    fleet,
    causes,
    compare,
    predict,
    margin,
    design,
    study,
    respond,
    track,
    fit,
    init,
    check,
    effects,
    show_topic,
):
    hdcal.add_command(_command)


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; every outcome is an exit code and plain words."""
    given = sys.argv[1:] if arguments is None else arguments
    if "_HDCAL_COMPLETE" in os.environ:
        # A shell asks for what may follow, and click answers and ends the process.
        hdcal.main([], "hdcal")
    for name, value in _environment():
        os.environ.setdefault(name, value)
    console = Console(json="--json" in given)
    console.prepare()
    _interrupt_once()
    code = _run(given, console)
    if code == INTERRUPTED and arguments is None:
        # Threads of XLA that are still at work would crash the end of the interpreter.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    sys.exit(NOBODY_READS if code == DONE and console.unread else code)


def _run(arguments: list[str], console: Console) -> int:
    try:
        os.getcwd()
    except OSError:
        words = "the working directory is gone"
        console.findings([Finding("command line", words, "Change to one that exists")])
        return BAD_INPUT
    try:
        code = hdcal.main(arguments, "hdcal", standalone_mode=False, obj=console)
        return code if isinstance(code, int) else DONE
    except click.UsageError as error:
        if not [one for one in arguments if one != "--json"]:
            none = Finding("command line", "names no command", "See hdcal --help")
            assert error.ctx is not None
            show = partial(click.echo, hdcal.get_help(error.ctx), err=True)
            console.findings([none], show)
            return BAD_INPUT
        found = usage_error(error)
        # Click would repeat what was written, however long.
        short = click.UsageError(ended(found.problem), error.ctx)
        console.findings([found], short.show)
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
    except SystemExit:
        # Click ends so when the reader of its help is gone.
        console.unread = True
        return DONE
    except (KeyboardInterrupt, click.Abort) as error:
        # Click raises its own one from it; what was written then is noted there.
        notes = getattr(error.__cause__ or error, "__notes__", ())
        console.words(f"interrupted: {'; '.join(notes) or 'nothing was written'}")
        return INTERRUPTED
    except OSError as error:
        words = f"the system refused: {error.strerror or error}"
        if error.filename is None:
            # A full disk behind standard output: what is left for it would fail again.
            discard_output()
        else:
            words += f": {error.filename}"
        return _failed(error, words, console)
    except Exception as error:
        what = " ".join(str(error).split())[:200] or "no further words"
        words = f"internal error ({type(error).__name__}: {what}); please report it, "
        return _failed(error, words + "with what HDCAL_DEBUG=1 prints", console)


def _failed(error: Exception, words: str, console: Console) -> int:
    if os.environ.get("HDCAL_DEBUG") == "1":
        raise error
    console.failure("error", words)
    return NOT_TO_BE_USED


def _environment() -> Iterator[tuple[str, str]]:
    """Yield variables of the environment that libraries read when they are imported.

    A value set by the user stands.
    """
    # Thousands of small steps run 35 times as fast on one core as beside an H200.
    yield "JAX_PLATFORMS", "cpu"
    folder = platformdirs.user_cache_dir("hdcal", False)
    yield "JAX_COMPILATION_CACHE_DIR", os.environ.get("HDCAL_CACHE_DIR", folder)
    yield "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0"
    yield "JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES", "-1"
    # JAX caches no program that may call back to raise an error: NaN is looked for.
    yield "EQX_ON_ERROR", "nan"
    # A diagnosis solves thousands of small systems, for which threads only wait.
    yield "OPENBLAS_NUM_THREADS", "1"


def _interrupt_once() -> None:
    """Clean up on SIGINT and on SIGTERM, and let a second one not disturb that."""
    heard = [signal.SIGTERM]
    # In the background of a script, or under nohup, SIGINT is ignored.
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        heard.append(signal.SIGINT)

    def stop(*_) -> None:
        for each in heard:
            signal.signal(each, signal.SIG_IGN)
        raise KeyboardInterrupt

    for each in heard:
        signal.signal(each, stop)


if __name__ == "__main__":
    main()
