"""One model of every report: what is said first, then sections of evidence.

A document holds texts and the names of figures, no numbers and no files: `html_page`,
`terminal_lines` and `notebook_html` show it, each in its own medium.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Any, ClassVar, Literal, TypeVar, cast

from hdcal.data.theory_names import SPRING
from hdcal.quantities import Quantities

# Sentences beside the headline: the first screen has three in all.
MOST_SAID = 2
A = TypeVar("A")
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
        page: rows that are shown at once; a browser turns to the others, and sorts and
            searches all of them. 0 shows every row everywhere.
    """

    kind: ClassVar[str] = "table"
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    numbers: frozenset[str] = frozenset()
    long: frozenset[str] = frozenset()
    names: frozenset[str] = frozenset()
    spare: frozenset[str] = frozenset()
    strong: frozenset[int] = frozenset()
    page: int = 0

    @property
    def first_page(self) -> Sequence[Sequence[Cell]]:
        """Return the rows that are shown where no page can be turned."""
        return self.rows[: self.page or None]


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
        appendix: how the answer was come by; after all that says something of it.
    """

    heading: str
    blocks: Sequence[Block]
    brief: bool = False
    appendix: bool = False


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
        answers: sentences that complete it; the first ones stand beside the headline.
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
    def said(self) -> Sequence[str]:
        """Return what is said at once, beside the headline."""
        return self.answers[:MOST_SAID]

    @property
    def more(self) -> Sequence[str]:
        """Return what else completes the answer."""
        return self.answers[MOST_SAID:]

    @property
    def lead(self) -> Picture | None:
        """Return the picture that is shown beside the answer; None without one."""
        pictures = (
            block
            for section in self.sections
            for block in section.blocks
            if isinstance(block, Picture)
        )
        return next(pictures, None)

    @property
    def next_step(self) -> str | None:
        """Return the most urgent of the next steps, or None."""
        return self.next_steps[0] if self.next_steps else None


def notices(
    *found: tuple[str, Sequence[str]], tone: Tone = "caution"
) -> tuple[Notice, ...]:
    """Return notices by title; those without a sentence are left out."""
    return tuple(Notice(title, said, tone) for title, said in found if said)


# "gear", where it is not the file of that name.
_GEAR = re.compile(r"(?<![-`'\[\w./])([Gg])ear(s?)(?![-`\]\w/]|\.\w| file)")


def spoken_of(document: Document, theory: str) -> Document:
    """Return a document that speaks of a part where no gear need be meant.

    What is measured as a spring may be anything that gives way. What a user named
    stays: it stands in the name, the subtitle and the appendix.

    Args:
        document: written of a gear.
        theory: of the model.
    """
    if theory != SPRING:
        return document
    sections = [
        section if section.appendix else _of_part(section)
        for section in document.sections
    ]
    said = _of_part(replace(document, sections=(), provenance=()))
    return replace(
        said,
        name=document.name,
        subtitle=document.subtitle,
        sections=sections,
        provenance=document.provenance,
    )


def answer_spoken_of(answer: A, theory: str) -> A:
    """Return an answer whose first sentences speak as its document does."""
    if theory != SPRING:
        return answer
    held = vars(answer)
    told = {
        n: _of_part(held[n]) for n in ("headline", "answer", "next_step") if n in held
    }
    return replace(cast(Any, answer), **told)


def _of_part(held: Any) -> Any:
    """Return a document or a piece of one, in other words."""
    return mapped(held, _part_words)


def _part_words(text: str) -> str:
    told = text.replace("influence coefficient K", "stiffness K")
    return _GEAR.sub(lambda g: ("P" if g[1] == "G" else "p") + f"art{g[2]}", told)


def mapped(held: Any, change: Callable[[str], str]) -> Any:
    """Return a document, a result or a piece of one with its texts changed.

    Args:
        held: of dataclasses, lists and texts.
        change: returns a text in other words.
    """
    if isinstance(held, str):
        return change(held)
    if is_dataclass(held) and not isinstance(held, type | Quantities):
        # A picture is called for by its name.
        kept = {"name"} if isinstance(held, Picture) else set()
        changed = {f.name for f in fields(held)} - kept
        return replace(held, **{n: mapped(getattr(held, n), change) for n in changed})
    if isinstance(held, list | tuple | frozenset):
        return type(held)(mapped(each, change) for each in held)
    return held
