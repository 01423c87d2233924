"""Output of a command: results on standard output, messages on standard error."""

import contextlib
import io
import logging
import os
import shlex
import sys
import warnings
from collections.abc import Callable, Iterable
from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING, Any, TextIO

import click

from hdcal.errors import Finding, Findings, quoted
from hdcal.report.plain import as_json, printable

if TYPE_CHECKING:
    from hdcal.report.result import Result
    from hdcal.report.saving import Target


def _read_too(out: str) -> list[Finding]:
    """Return a finding where a result would replace its own input."""
    context = click.get_current_context(silent=True)
    if context is None:
        return []
    read: list[str] = []
    for parameter in context.command.params:
        given = context.params.get(str(parameter.name))
        if isinstance(parameter, click.Argument) and given:
            read += [given] if isinstance(given, str) else given
    if os.path.realpath(out) not in map(os.path.realpath, read):
        return []
    return [Finding("out", f"{quoted(out)} is read too", "Name another folder")]


class Console:
    """The two streams of one command.

    Args:
        json: whether standard output carries one JSON object and nothing else.
    """

    def __init__(self, *, json: bool):
        self.json = json
        # Findings about options and input, collected before the work.
        self.wrong = Findings()
        # Where the result goes; `reserve_folder` sets it.
        self.folder: Target | None = None
        # Whether the reader of the output is gone.
        self.unread = False

    def prepare(self) -> None:
        """Quiet the libraries, and let any text be printed on any terminal."""
        # Closed ones are None.
        sys.stdout, sys.stderr = (
            stream or open(os.devnull, "w")  # noqa: SIM115, as long as the process
            for stream in (sys.stdout, sys.stderr)
        )
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="backslashreplace")
        if os.environ.get("HDCAL_DEBUG") == "1":
            return
        # Set before jaxlib loads: its C++ log bypasses Python's streams.
        os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
        logging.getLogger("jax").setLevel(logging.ERROR)
        logging.getLogger("absl").setLevel(logging.ERROR)
        if not sys.warnoptions:
            warnings.simplefilter("ignore")

    @property
    def command(self) -> str:
        """Return the command line for a result's provenance.

        Without --jobs: the same result has the same bytes.
        """
        given, kept = iter(sys.argv[1:]), ["hdcal"]
        for part in given:
            if part == "--jobs":
                next(given, None)
            elif not part.startswith("--jobs="):
                kept.append(part)
        return shlex.join(kept)

    def reserve_folder(
        self, out: str | None, force: bool, replace: str = "force"
    ) -> None:
        """Reserve the result folder before any work, or add a finding.

        Args:
            out: the folder to make, or None.
            force: whether an older result may be replaced.
            replace: the parameter that says so.
        """
        if out is not None:
            from hdcal.report.saving import Target

            self.wrong += _read_too(out)
            self.folder = self.hold(partial(Target, out, force, replace))

    def hold(self, reserve: "Callable[[], Target]") -> "Target | None":
        """Return a target that is held until the command ends, or None.

        Args:
            reserve: makes the target; the findings of its refusal are collected.
        """
        target = self.wrong.attempt(reserve)
        if target is not None:
            click.get_current_context().with_resource(target)
        return target

    def show(self, result: "Result", **files: Any) -> int:
        """Write the reserved folder if there is one, print a result, return its code.

        Args:
            result: what to write and print.
            files: what `write_result` takes: names and content of the files.
        """
        if self.folder is not None:
            from hdcal.report.result_folder import write_result

            write_result(result, self.folder, command=self.command, **files)
        return self.show_written(result)

    def show_written(self, result: "Result") -> int:
        """Print a result whose folder is written, and return the command's exit code.

        Args:
            result: what to print.
        """
        from hdcal.report.terminal_text import terminal_parts

        folder = None if self.folder is None else self.folder.name
        self.table(*terminal_parts(result, folder))
        if self.json:
            self._print(result.to_json().rstrip(), to_error=False)
        return 0 if result.status == "ok" else 1

    def result(self, text: str) -> None:
        """Print the result for people; with --json it moves to standard error."""
        self._print(text, to_error=self.json)

    def data(self, plain: dict[str, Any]) -> None:
        """Print the one JSON object."""
        self._print(as_json(plain).rstrip(), to_error=False)

    def words(self, text: str) -> None:
        """Print a remark."""
        lines = "\n".join(printable(line) for line in text.splitlines())
        self._print(f"hdcal: {lines}", to_error=True)

    def findings(
        self, findings: Iterable[Finding], show: Callable[[], None] | None = None
    ) -> None:
        """Print every finding, and as JSON where that was asked for.

        Args:
            findings: what is wrong.
            show: prints them for people; by default each becomes one line.
        """
        listed = list(findings)
        if show is not None:
            _to_error(show)
        for finding in listed if show is None else ():
            self.words(str(finding))
        if self.json:
            self.data({"status": "error", "findings": [asdict(f) for f in listed]})

    def failure(self, status: str, text: str) -> None:
        """Print why there is no result."""
        self.words(text)
        if self.json:
            self.data({"status": status, "reasons": [text]})

    def table(self, *parts: Any) -> None:
        """Print rich's tables and texts as the result for people."""
        from rich.console import Console as RichConsole

        terminal = (sys.stderr if self.json else sys.stdout).isatty()
        # Outside a terminal rich would guess 80 columns and break the tables.
        width = None if terminal else 110
        # Not the stream itself: rich would write to it, and end the process by itself
        # where that fails.
        drawn = io.StringIO()
        rich = RichConsole(
            file=drawn,
            force_terminal=terminal or None,
            width=width,
            highlight=False,
            emoji=False,
        )
        rich.print(*parts, sep="\n")
        lines = (line.rstrip() for line in drawn.getvalue().splitlines())
        self.result("\n".join(lines))

    def _print(self, text: str, *, to_error: bool) -> None:
        if to_error:
            _to_error(partial(print, text, file=sys.stderr, flush=True))
            return
        try:
            print(text, flush=True)
        except BrokenPipeError:
            self.unread = True
            discard_output()


def _to_error(show: Callable[[], None]) -> None:
    """Show something on standard error, if anything can be shown there."""
    try:
        show()
    except OSError:
        # A message that cannot be written cannot be reported either.
        _discard(sys.stderr)


def discard_output() -> None:
    """Send standard output nowhere, once its reader is gone."""
    _discard(sys.stdout)


def _discard(stream: TextIO) -> None:
    # Python would complain again when it flushes.
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def usage_error(error: click.UsageError) -> Finding:
    """Return a mistake on the command line as a finding."""
    command = error.ctx.command_path if error.ctx else "hdcal"
    remedy = f"See {command} --help"
    return Finding("command line", error.format_message().rstrip("."), remedy)
