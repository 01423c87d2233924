"""A document as lines for a terminal: the answer, the brief tables, what to do next."""

from collections.abc import Iterator, Sequence

from rich import box
from rich.console import RenderableType
from rich.padding import Padding
from rich.table import Table as RichTable
from rich.text import Text as RichText

from hdcal.report.document import (
    Block,
    Cell,
    Details,
    Document,
    Facts,
    Sentences,
    Table,
    Tag,
    Text,
)
from hdcal.report.plain import printable

_COLOURS = {"good": "green", "caution": "yellow", "bad": "red", "neutral": ""}


def terminal_lines(
    document: Document, folder: str | None = None, opened: str = "report.html"
) -> Iterator[RenderableType]:
    """Yield a document for a terminal; figures and long sections are left out.

    Args:
        document: what to show; its texts may come from anywhere.
        folder: where the whole result lies, or None.
        opened: what to open in it first; empty where that depends.
    """
    title = f"{document.name}: {document.subtitle}"
    yield RichText(printable(title), "bold")
    if document.failed:
        yield RichText("FAILED: this result must not be used.", "bold red")
        yield from _lines(document.failed, "red")
    else:
        yield from _lines([document.headline, *document.said], indent=0)
        if document.more:
            yield RichText("\nIn detail", "bold")
            yield from _lines(document.more)
    for section in document.sections:
        if section.brief:
            yield RichText(f"\n{printable(section.heading)}", "bold")
            for block in section.blocks:
                yield from _block(block)
    for notice in document.notices:
        yield from _titled(notice.title, notice.sentences, _COLOURS[notice.tone])
    yield from _titled("What to do next", document.next_steps[:1])
    if folder is not None:
        how = f"  (open {opened})" if opened else ""
        yield RichText(f"\nThe result: {printable(folder)}{how}")


def _titled(title: str, said: Sequence[str], colour: str = "") -> Iterator:
    if said:
        yield RichText(printable(title), f"bold {colour}".strip())
        yield from _lines(said)


def _lines(said: Sequence[str], colour: str = "", indent: int = 2) -> Iterator:
    for words in said:
        yield Padding(RichText(printable(words), colour), (0, 0, 0, indent))


def _block(block: Block) -> Iterator[RenderableType]:
    match block:
        case Table():
            yield _table(block)
        case Text():
            yield from _lines([block.words])
        case Sentences():
            yield from _lines(block.items)
        case Facts():
            yield from _lines([f"{name}: {words}" for name, words in block.rows])
        case Details():
            for inner in block.blocks:
                yield from _block(inner)


def _table(table: Table) -> RichTable:
    made = RichTable(box=box.SIMPLE_HEAD, pad_edge=False)
    shown = [i for i, title in enumerate(table.columns) if title not in table.spare]
    for title in (table.columns[i] for i in shown):
        right = title in table.numbers
        whole = right or title in table.names
        made.add_column(
            RichText(title), justify="right" if right else "left", no_wrap=whole
        )
    for index, row in enumerate(table.first_page):
        style = "bold" if index in table.strong else ""
        made.add_row(*(_cell(row[i]) for i in shown), style=style)
    return made


def _cell(cell: Cell) -> RichText:
    if isinstance(cell, Tag):
        return RichText(printable(cell.word), _COLOURS[cell.tone])
    return RichText("\n".join(map(printable, cell.split("\n"))))
