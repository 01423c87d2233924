"""The page about the way of data is true, and no two classes share a name."""

import re
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "architecture.md").read_text("utf-8")
PACKAGE = ROOT / "src" / "hdcal"


# The older classes of these names go when the last question returns a `Result`.
MOVING = {"Chart", "Interval"}


def named() -> list[str]:
    """Return the files that the page's table names."""
    return re.findall(r"^\|[^|]*\| `([\w/]+\.py)` \|", PAGE, re.MULTILINE)


def test_every_file_that_is_named_exists():
    assert len(named()) > 20
    assert [path for path in named() if not (PACKAGE / path).is_file()] == []


def test_no_name_stands_for_two_classes():
    texts = (path.read_text("utf-8") for path in PACKAGE.rglob("*.py"))
    count = Counter(n for t in texts for n in re.findall(r"^class (\w+)", t, re.M))
    assert len(count) > 100
    assert [
        name for name, often in count.items() if often > 1 and name not in MOVING
    ] == []


def test_every_room_is_named():
    rooms = {path.name for path in PACKAGE.iterdir() if (path / "__init__.py").exists()}
    assert len(rooms) > 10
    assert [room for room in sorted(rooms) if f"{room}" not in PAGE] == []


def test_the_picture_names_steps_of_the_table():
    picture = (ROOT / "docs" / "_static" / "way-of-data.svg").read_text("utf-8")
    for file in re.findall(r"[\w]+/[\w]+\.py", picture):
        assert file in named()
