"""Output of a command: results on standard output, messages on standard error."""

import io
import json
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

from hdcal.errors import Finding, Findings, printable, quoted

if TYPE_CHECKING:
    from hdcal.report.result import Result
    from hdcal.report.saving import Target


def _would_replace_input(out: str) -> list[Finding]:
    """Return a finding if the result would replace an input of the command."""
    context = click.get_current_context(silent=True)
    if context is None:
        return []
    read: list[str] = []
    for parameter in context.command.params:
        value = context.params.get(str(parameter.name))
        if isinstance(parameter, click.Argument) and value:
            read += [value] if isinstance(value, str) else value
    if os.path.realpath(out) not in map(os.path.realpath, read):
        return []
    return [Finding("out", f"{quoted(out)} is also an input", "Give another folder")]


class Console:
    """The two output streams of one command."""

    def __init__(self, *, json: bool):
        # Whether standard output carries one JSON object and nothing else.
        self.json = json
        # Findings about options and input, collected before the work.
        self.wrong = Findings()
        self.folder: Target | None = None
        # Whether the reader of standard output has closed it.
        self.unread = False

    def prepare(self) -> None:
        """Suppress messages of libraries; let any text be printed on any terminal."""
        # Streams that were closed before the start are None.
        sys.stdin = sys.stdin or open(os.devnull)  # noqa: SIM115, as long as the process
        sys.stdout = sys.stdout or open(os.devnull, "w")  # noqa: SIM115
        sys.stderr = sys.stderr or open(os.devnull, "w")  # noqa: SIM115
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
        """The command line, for a result's provenance.

        Without --jobs: the same result has the same bytes.
        """
        parts, kept = iter(sys.argv[1:]), ["hdcal"]
        for part in parts:
            if part == "--jobs":
                next(parts, None)
            elif not part.startswith("--jobs="):
                kept.append(part)
        return shlex.join(kept)

    def reserve_folder(
        self, out: str | None, force: bool, replace: str = "force"
    ) -> None:
        """Reserve the result folder, if any, before any work, or add a finding.

        The parameter named `replace` allows to replace an older result.
        """
        if out is not None:
            from hdcal.report.saving import Target

            self.wrong += _would_replace_input(out)
            self.folder = self.hold(partial(Target, out, force, replace))

    def hold(self, reserve: "Callable[[], Target]") -> "Target | None":
        """Return a target that is locked until the command ends, or None."""
        target = self.wrong.attempt(reserve)
        if target is not None:
            click.get_current_context().with_resource(target)
        return target

    def show(self, result: "Result", **files: Any) -> int:
        """Write the reserved folder, if any; print the result; return the exit code.

        The files are further arguments of `write_result`.
        """
        if self.folder is not None:
            from hdcal.report.result_folder import write_result

            write_result(result, self.folder, command=self.command, **files)
        return self.show_written(result)

    def show_written(self, result: "Result") -> int:
        """Print a result whose folder is written; return the exit code."""
        from hdcal.report.terminal_text import terminal_parts

        folder = None if self.folder is None else self.folder.name
        self.table(*terminal_parts(result, folder))
        if self.json:
            self._print(result.to_json().rstrip(), to_error=False)
        return 0 if result.status == "ok" else 1

    def result(self, text: str) -> None:
        """Print the result for people; with --json to standard error."""
        self._print(text, to_error=self.json)

    def data(self, plain: dict[str, Any]) -> None:
        """Print the JSON object."""
        self._print(json.dumps(plain, indent=2, allow_nan=False), to_error=False)

    def words(self, text: str) -> None:
        """Print a message."""
        lines = "\n".join(printable(line) for line in text.splitlines())
        self._print(f"hdcal: {lines}", to_error=True)

    def findings(self, findings: Iterable[Finding], text: str | None = None) -> None:
        """Print every finding, or the text, and as JSON if --json was given."""
        listed = list(findings)
        if text is not None:
            self._print(text, to_error=True)
        else:
            for finding in listed:
                self.words(str(finding))
        if self.json:
            self.data({"status": "error", "findings": [asdict(f) for f in listed]})

    def failure(self, status: str, text: str) -> None:
        """Print why there is no result."""
        self.words(text)
        if self.json:
            self.data({"status": status, "reasons": [text]})

    def table(self, *parts: Any) -> None:
        """Print rich tables and texts as the result for people."""
        from hdcal.report.terminal_text import drawn

        terminal = (sys.stderr if self.json else sys.stdout).isatty()
        # Outside a terminal rich would assume 80 columns and break the tables.
        self.result(drawn(parts, None if terminal else 110, colours=terminal))

    def _print(self, text: str, *, to_error: bool) -> None:
        stream = sys.stderr if to_error else sys.stdout
        try:
            print(text, file=stream, flush=True)
        except OSError as error:
            # A message that cannot be written cannot be reported either.
            if not (to_error or isinstance(error, BrokenPipeError)):
                raise
            self.unread |= not to_error
            discard(stream)


def discard(stream: TextIO) -> None:
    """Redirect a stream to nowhere: flushing it again would fail again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
