"""One model of every report: what is said first, then sections of evidence.

A document holds texts and the names of figures, no numbers and no files: `html_page`,
`terminal_lines` and `notebook_html` show it, each in its own medium.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal

Tone = Literal["good", "caution", "bad", "neutral"]


@dataclass(frozen=True)
class Tag:
    """A word in a table's cell that is set off by a colour."""

    word: str
    tone: Tone

    def __str__(self) -> str:
        return self.word


# A line break in a cell starts smaller print below the first line.
Cell = str | Tag


@dataclass(frozen=True)
class Text:
    """A paragraph; soft ones explain, others answer."""

    kind: ClassVar[str] = "text"
    words: str
    soft: bool = False


@dataclass(frozen=True)
class Sentences:
    """A list of sentences."""

    kind: ClassVar[str] = "sentences"
    items: Sequence[str]


@dataclass(frozen=True)
class Facts:
    """Pairs of name and words."""

    kind: ClassVar[str] = "facts"
    rows: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Table:
    """A table of texts.

    Attributes:
        columns: titles.
        rows: one cell for each column.
        numbers: titles of the columns that hold numbers, aligned to the right.
        long: titles of the columns whose texts may break anywhere.
        names: titles of the columns whose texts may not break.
        spare: titles of the columns that a terminal leaves out.
        strong: indices of the rows that stand out.
    """

    kind: ClassVar[str] = "table"
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    numbers: frozenset[str] = frozenset()
    long: frozenset[str] = frozenset()
    names: frozenset[str] = frozenset()
    spare: frozenset[str] = frozenset()
    strong: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Picture:
    """A figure by the name under which its drawing is handed to a renderer.

    Attributes:
        name: of the drawing, and of its files in a result folder.
        shows: what is to be seen, for those who cannot see it.
        caption: how to read it.
        tall: it may take a whole printed page.
    """

    kind: ClassVar[str] = "picture"
    name: str
    shows: str
    caption: str
    tall: bool = False


@dataclass(frozen=True)
class Details:
    """Blocks under a small heading; folded away where the medium can fold."""

    kind: ClassVar[str] = "details"
    heading: str
    blocks: Sequence["Block"]
    folded: bool = True


Block = Text | Sentences | Facts | Table | Picture | Details


@dataclass(frozen=True)
class Section:
    """Blocks under a heading.

    Attributes:
        heading: of the section.
        blocks: in their order; figures are left out in a terminal.
        brief: shown also where room is scarce, in a terminal and in a notebook.
    """

    heading: str
    blocks: Sequence[Block]
    brief: bool = False


@dataclass(frozen=True)
class Notice:
    """Sentences in a coloured frame, before all sections."""

    title: str
    sentences: Sequence[str]
    tone: Tone = "caution"


@dataclass(frozen=True)
class Document:
    """A report.

    Attributes:
        name: what it is about, often the gear's name.
        kind: what it is, such as "calibration".
        subtitle: one sentence below the name.
        headline: the answer in one sentence.
        answers: sentences that complete it.
        next_steps: what to do next, most urgent first.
        notices: what to be aware of.
        sections: the evidence.
        provenance: how it was made, as pairs of name and words.
        failed: reasons why the result must not be used; empty if it may be.
        failed_words: what such a failure means for the reader.
    """

    name: str
    kind: str
    subtitle: str
    headline: str
    answers: Sequence[str] = ()
    next_steps: Sequence[str] = ()
    notices: Sequence[Notice] = ()
    sections: Sequence[Section] = ()
    provenance: Sequence[tuple[str, str]] = ()
    failed: Sequence[str] = ()
    failed_words: str = field(
        default="The result did not pass its checks, so every number on this page may "
        "be wrong."
    )

    @property
    def next_step(self) -> str | None:
        """Return the most urgent of the next steps, or None."""
        return self.next_steps[0] if self.next_steps else None


def notices(
    *found: tuple[str, Sequence[str]], tone: Tone = "caution"
) -> tuple[Notice, ...]:
    """Return notices by title; those without a sentence are left out."""
    return tuple(Notice(title, said, tone) for title, said in found if said)
