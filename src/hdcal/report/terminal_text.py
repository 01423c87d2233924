"""A result as a terminal prints it, by rich's Markdown."""

import io
from collections.abc import Iterable, Iterator
from textwrap import fill
from typing import TYPE_CHECKING, ClassVar

from rich import box
from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.markdown import Heading, Markdown, TableElement
from rich.table import Table
from rich.text import Text

from hdcal.errors import printable
from hdcal.report.markdown import parsed, shortened

if TYPE_CHECKING:
    from hdcal.report.result import Result

# A longer word may wrap, so that the numbers have room.
_LONGEST = 30
# Blanks between columns.
_GAP = 2


class _Heading(Heading):
    """A heading in bold at the left edge, directly above what follows."""

    new_line = False

    def __rich_console__(
        self, console: Console, options: ConsoleOptions
    ) -> RenderResult:
        yield Text(self.text.plain, "bold")


class _Table(TableElement):
    """A table in which numbers and words are not broken."""

    def __rich_console__(
        self, console: Console, options: ConsoleOptions
    ) -> RenderResult:
        look = {"box": box.SIMPLE_HEAD, "padding": (0, _GAP - 1, 0, 0)}
        table = Table(**look, pad_edge=False, show_edge=False)
        rows = [row.cells for row in self.body.rows] if self.body else []
        header = self.header.row.cells if self.header and self.header.row else []
        columns = [[row[i].content.plain for row in rows] for i in range(len(header))]
        widths = [
            _needed(cell.content.plain, texts, numbers=cell.justify == "right")
            for cell, texts in zip(header, columns, strict=True)
        ]
        room = options.max_width - _GAP * (len(widths) - 1)
        tight = sum(widths) > room
        every = zip(header, columns, strict=True)
        longest = [max(map(len, [c.content.plain, *texts])) for c, texts in every]
        for cell, texts, width in zip(header, columns, widths, strict=True):
            right, title = cell.justify == "right", cell.content.plain
            # A column of words wraps where numbers would lose digits.
            whole = right or (not tight and max(map(len, texts), default=0) <= width)
            if whole and title and sum(longest) > room:
                # A column that does not wrap would not wrap its title either.
                title = fill(title, width, break_long_words=False)
            justify = "right" if right else "left"
            table.add_column(
                Text(title), justify=justify, no_wrap=whole, overflow="fold"
            )
        for cells in rows:
            table.add_row(*(cell.content for cell in cells))
        yield table


def _needed(title: str, texts: list[str], *, numbers: bool) -> int:
    """Return the width of a column whose numbers are whole, and its words if short."""
    parts = texts if numbers else [word for text in texts for word in text.split()]
    widest = max(map(len, [*parts, *title.split()]), default=0)
    return widest if numbers else min(widest, _LONGEST)


class _Markdown(Markdown):
    """Markdown without figures, whose tables can be read in plain text."""

    elements: ClassVar = Markdown.elements | {
        "heading_open": _Heading,
        "table_open": _Table,
    }

    def __init__(self, text: str):
        super().__init__("", hyperlinks=False)
        self.parsed = shortened(parsed(text))


def terminal_parts(
    result: "Result", folder: str | None = None
) -> Iterator[RenderableType]:
    """Yield what a terminal prints of a result, and where it was written, if it was."""
    yield Text(f"{result.line('title')}: {result.line('subtitle')}", "bold")
    if result.reasons:
        yield Text("FAILED: this result must not be used.", "bold red")
        yield from (Text(f"  {printable(why)}", "red") for why in result.reasons)
    shown = ["" if result.reasons else result.block("headline"), result.block("body")]
    if result.next_step:
        shown.append(f"**Next step:** {result.block('next_step')}")
    yield _Markdown("\n\n".join(shown))
    if folder is not None:
        yield Text(f"\nThe result: {printable(folder)}  (open report.html)")


def drawn(
    parts: Iterable[RenderableType], width: int | None, *, colours: bool = False
) -> str:
    """Return the text of parts, as wide as given or as the terminal."""
    target = io.StringIO()
    console = Console(
        file=target,
        force_terminal=colours or None,
        width=width,
        highlight=False,
        emoji=False,
    )
    console.print(*parts, sep="\n")
    return "\n".join(line.rstrip() for line in target.getvalue().splitlines())
