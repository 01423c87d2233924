"""The closing words of a diagnosis, for a person at a terminal."""

from collections import Counter
from collections.abc import Iterator

from rich import box
from rich.console import RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from hdcal.report.paragraph import paragraph
from hdcal.report.plain import harmless
from hdcal.report.words import hypothesis, newton, percent


def closing_words(
    found: dict, folder: str, *, report: bool = True
) -> Iterator[RenderableType]:
    """Yield where the model is off, why, how far that closes, and what to do next.

    Args:
        found: the verdict as plain data.
        folder: where the result lies.
        report: whether there is a report.
    """
    found = harmless(found)
    name, rows = found["gear"]["name"], found["data"]["rows"]
    yield Text(f"{name}: {rows} rows, theory {found['gear']['theory']}", "bold")
    if found["status"] != "ok":
        yield Text("FAILED: this result must not be used.", "bold red")
        for reason in found["reasons"]:
            yield Padding(Text(reason, "red"), (0, 0, 0, 2))
    for sentence in found["answer"]:
        yield Text(sentence)
    yield Text("")
    yield from paragraph("What this cannot say", found["limits"])
    yield from paragraph("Remarks", found["notes"])
    heading = "Other runs that would help, if the cause is in the library"
    yield from paragraph(heading, _runs(found["next_test"][1:4]))
    opened = "report.html" if report else "verdict.json"
    yield Text(f"\nThe result: {harmless(folder)}  (open {opened})")


def _runs(listed: list[dict]) -> list[str]:
    return [
        f"{run['run']} ({run['cost']}): tells {', '.join(map(hypothesis, told))}"
        for run in listed
        if (told := run["separates"])
    ]


def overview(found: dict[str, dict], folder: str) -> Iterator[RenderableType]:
    """Yield a table with one row per case.

    Args:
        found: verdicts as plain data by name.
        folder: where the results lie.
    """
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("case", "verdict", "cause"):
        table.add_column(heading)
    for heading in ("probability", "gap", "closed"):
        table.add_column(heading, justify="right")
    for name, verdict in found.items():
        table.add_row(*map(Text, _row(harmless(name), harmless(verdict))))
    yield table
    words = Counter(_verdict(verdict) for verdict in found.values())
    yield Text(", ".join(f"{many} {word}" for word, many in words.most_common()))
    yield Text(f"\nThe results: {harmless(folder)}")


def _verdict(found: dict) -> str:
    return "FAILED" if found["status"] != "ok" else found["which"]["verdict"]


def _row(name: str, found: dict) -> list[str]:
    which, closed = found["which"], found["shrink"]["closed"]
    size = found["gap"]["rms_N"]["median"]
    if found["status"] != "ok":
        return [name, _verdict(found), "", "", "", ""]
    word = which["verdict"]
    cause = word if word in ("none", "unknown") else which["effect"]
    chance = which["inclusion"].get(cause, which["probabilities"].get(cause))
    return [
        name,
        word,
        "–" if word == "none" else hypothesis(cause),
        percent(chance),
        "–" if size is None else newton(size),
        "–" if closed is None else percent(closed["median"]),
    ]
