"""Sentences for a person at a terminal."""

from collections.abc import Iterator

from rich.console import RenderableType
from rich.padding import Padding
from rich.text import Text


def paragraph(
    heading: str, sentences: list[str], colour: str = ""
) -> Iterator[RenderableType]:
    """Yield sentences under a heading; without any, nothing."""
    if not sentences:
        return
    yield Text(heading, f"bold {colour}".strip())
    for sentence in sentences:
        yield Padding(Text(sentence), (0, 0, 0, 2))
