"""A page of tables and sentences: what a command says in the terminal, for a reader."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from rich import box
from rich.console import RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from hdcal.report.page import render_page
from hdcal.report.plain import printable

_TEMPLATE = "sheet.html.j2"


@dataclass(frozen=True)
class Section:
    """One table with its heading and the sentences below it.

    Attributes:
        heading: of the section.
        columns: titles of the table's columns.
        rows: cells as texts.
        numbers: which of the columns hold numbers, aligned to the right.
        words: sentences below the table.
        image: name of a figure above it, or empty; on the page only.
        caption: of the figure.
    """

    heading: str
    columns: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    numbers: frozenset[str] = frozenset()
    words: Sequence[str] = ()
    image: str = ""
    caption: str = ""


@dataclass(frozen=True)
class Sheet:
    """A heading, the answers in sentences, warnings, and sections.

    Attributes:
        name: what it is about.
        kind: what it is.
        subtitle: one sentence below the name.
        answers: sentences to be read first.
        warnings: sentences to be aware of.
        sections: the tables.
    """

    name: str
    kind: str
    subtitle: str
    answers: Sequence[str]
    warnings: Sequence[str]
    sections: Sequence[Section]


def sheet_page(
    sheet: Sheet, provenance: Sequence[tuple[str, str]], images: Mapping[str, bytes]
) -> str:
    """Return a sheet as the text of an HTML file that needs nothing else.

    Args:
        sheet: what to show.
        provenance: pairs of name and words.
        images: SVG files that the sections name.
    """
    context = {**vars(sheet), "failed": False, "provenance": list(provenance)}
    context["sections"] = [vars(section) for section in sheet.sections]
    return render_page(_TEMPLATE, context, dict(images))


def sheet_words(sheet: Sheet) -> Iterator[RenderableType]:
    """Yield a sheet for a terminal; figures are left out."""
    yield Text(f"{printable(sheet.name)}: {printable(sheet.subtitle)}", "bold")
    for section in sheet.sections:
        if not section.rows and not section.words:
            continue
        yield Text(f"\n{printable(section.heading)}", "bold")
        if section.rows:
            yield _table(section)
        yield from _lines(section.words)
    if sheet.warnings:
        yield Text("\nTo be aware of", "bold yellow")
        yield from _lines(sheet.warnings)
    if sheet.answers:
        yield Text("\nIn short", "bold")
        yield from _lines(sheet.answers)


def _table(section: Section) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for title in section.columns:
        right = title in section.numbers
        table.add_column(title, justify="right" if right else "left", no_wrap=right)
    for row in section.rows:
        table.add_row(*(Text(printable(cell)) for cell in row))
    return table


def _lines(sentences: Sequence[str]) -> Iterator[RenderableType]:
    for sentence in sentences:
        yield Padding(Text(printable(sentence)), (0, 0, 0, 2))
