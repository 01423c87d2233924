"""What a document says first, and of what it speaks."""

from dataclasses import replace

import pytest

from hdcal.report.document import (
    Document,
    Facts,
    Picture,
    Section,
    Sentences,
    Table,
    spoken_of,
)
from hdcal.report.html import html_page
from hdcal.report.terminal import terminal_lines

SHOWN = Picture("gear", "a gear", "The gear.")
DOCUMENT = Document(
    name="gear 7",
    kind="test",
    subtitle="About gear 7 (gear.csv).",
    headline="The gear is stiff.",
    answers=["One.", "Two gears.", "Three."],
    next_steps=["Look at the gear file gear.toml.", "Measure another gear."],
    sections=[
        Section("Gears", [SHOWN, Table(["gear"], [["Gear"]], frozenset({"gear"}))]),
        Section("Data", [Facts([("gear", "gear 7")])], appendix=True),
        Section("Left", [Sentences(["influence coefficient K"])], brief=True),
    ],
    provenance=[("gear", "gear 7")],
)
IMAGES = {"gear": b"<svg/>"}


def test_a_spring_is_a_part():
    found = spoken_of(DOCUMENT, "spring")
    assert found.headline == "The part is stiff."
    assert found.answers == ["One.", "Two parts.", "Three."]
    assert found.next_steps[0] == "Look at the gear file gear.toml."
    first, kept, last = found.sections
    assert first.heading == "Parts"
    table = first.blocks[1]
    assert (table.columns, table.rows, table.numbers) == (
        ["part"],
        [["Part"]],
        {"part"},
    )
    assert last.blocks[0].items == ["stiffness K"]
    # What somebody named stays, and so does what a figure is called for by.
    assert (found.name, found.subtitle) == (DOCUMENT.name, DOCUMENT.subtitle)
    assert (kept, found.provenance) == (DOCUMENT.sections[1], DOCUMENT.provenance)
    assert found.lead.name == "gear" and found.lead.caption == "The part."
    assert spoken_of(DOCUMENT, "ring") is DOCUMENT


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("Gear gear-2 of gears.", "Part gear-2 of parts."),
        ("`gear` and --gear GEAR.toml", "`gear` and --gear GEAR.toml"),
        ("the gear file, [gear], gear.csv", "the gear file, [gear], gear.csv"),
        ("of one gear. Its gear, too", "of one part. Its part, too"),
    ],
)
def test_names_and_options_are_no_gears(said, told):
    assert spoken_of(replace(DOCUMENT, headline=said), "spring").headline == told


def test_the_answer_comes_first_and_once():
    page = html_page(DOCUMENT, IMAGES)
    shown, folded = page.split('<section class="folded">', 1)
    places = [shown.index(words) for words in ("is stiff", "One.", "Two gears", "<img")]
    assert places == sorted(places)
    assert "Three." not in shown and "Three." in folded
    assert "Look at the gear file" in shown and "Measure another" in folded
    assert page.count("<img") == 1
    assert folded.index("Left") < folded.index("Appendix") < folded.index("Data")
    assert "<details open" not in page
    lines = [
        str(getattr(line, "renderable", line)) for line in terminal_lines(DOCUMENT)
    ]
    assert (
        lines.index("Two gears.") < lines.index("\nIn detail") < lines.index("Three.")
    )
    assert not any("another gear" in line for line in lines)


def test_without_a_picture_what_matters_most_is_open():
    bare = Document("a", "b", "c", "d", sections=DOCUMENT.sections[1:])
    page = html_page(bare, {})
    assert page.count("<details open") == 1 == page.count("<li>influence")
