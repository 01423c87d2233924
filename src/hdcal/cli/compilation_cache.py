"""Programs are kept between runs: to trace and compile costs more than sampling."""

import os
import secrets
from functools import partial
from pathlib import Path

import click
from click.core import ParameterSource

from hdcal.cli.console import Console
from hdcal.errors import Finding, InputError, quoted

# In the context of a command: that it loads ahead.
_ASKED = f"{__name__}.asked"


def one_thread_for_algebra() -> None:
    """Keep OpenBLAS to one thread; to be called before NumPy is imported.

    A diagnosis solves thousands of small systems, over which threads only wait for
    each other. What the user has set stands.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def keep_compilations() -> None:
    """Keep on disk what was compiled, for later processes.

    Commands do. A script that calls it first starts faster from its second run on, with
    the same results. What has code of a user's own effects is traced anew.

    The folder is the user's cache folder, or what the environment variable
    HDCAL_CACHE_DIR names; where it cannot be written, nothing is kept, and a command
    says so. JAX' own compilation cache, which cannot serve beside it, is switched off
    for the process.

    Raises:
        InputError: JAX is told to use a processor that is not here.
    """
    if os.environ.get("JAX_PLATFORMS", "cpu") != "cpu":
        _require_platform()
    chosen = _cache_folder()
    kept = _is_writable(chosen)
    if kept:
        from hdcal.programs.files import folder, keep_in

        keep_in(str(chosen))
        kept = folder() is not None
    command = click.get_current_context(silent=True)
    if command is None or _ASKED in command.meta:
        return
    command.meta[_ASKED] = True
    if kept:
        _load_ahead(command)
    elif (console := command.find_object(Console)) is not None:
        console.words(
            f"{chosen}: nothing is kept here, where you, and nobody else, should be "
            "able to write; each run takes seconds longer. HDCAL_CACHE_DIR names "
            "another folder."
        )


def _load_ahead(command: click.Context) -> None:
    """Load what the command needed the last time that these options were given."""
    from hdcal.programs import ahead

    own = ParameterSource.COMMANDLINE
    given = [n for n in command.params if command.get_parameter_source(n) is own]
    task = "-".join([*command.command_path.split(), *sorted(given)])
    command.call_on_close(partial(ahead.end, task))
    ahead.begin(task)


def _require_platform() -> None:
    import jax

    try:
        jax.devices()
    except (RuntimeError, AssertionError):
        words = f"names {quoted(os.environ['JAX_PLATFORMS'])}, which JAX has not here"
        remedy = "Unset it, or name what is here, such as cpu"
        raise InputError([Finding("JAX_PLATFORMS", words, remedy)]) from None


def _cache_folder() -> Path:
    import platformdirs

    named = os.environ.get("HDCAL_CACHE_DIR")
    return Path(named or platformdirs.user_cache_dir("hdcal", False)) / "compiled"


def _is_writable(folder: Path) -> bool:
    trial = folder / f".trial-{secrets.token_hex(4)}"
    try:
        # Nobody else may write what is run.
        folder.mkdir(0o700, parents=True, exist_ok=True)
        trial.touch()
        trial.unlink()
    except (OSError, ValueError, RuntimeError):
        return False
    return True
