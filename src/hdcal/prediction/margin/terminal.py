"""The closing words of a margin, for a person at a terminal."""

from collections.abc import Iterator

from rich.console import RenderableType
from rich.text import Text

from hdcal.report.paragraph import paragraph
from hdcal.report.plain import harmless


def closing_words(plain: dict, folder: str | None) -> Iterator[RenderableType]:
    """Yield the answer, whose forces it is about, and what it rests on.

    Args:
        plain: the margin as plain data.
        folder: where the result lies, or None.
    """
    plain = harmless(plain)
    yield Text(f"{plain['gear']['name']}, theory {plain['gear']['theory']}", "bold")
    for sentence in plain["answer"]:
        yield Text(sentence)
    yield from paragraph("Outside what was tested", plain["extrapolated"], "yellow")
    yield from paragraph("To be aware of", plain["remarks"], "yellow")
    if folder is not None:
        yield Text(f"\nThe result: {harmless(folder)}  (open report.html)")
