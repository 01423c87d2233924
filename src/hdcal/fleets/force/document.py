"""The force of gears to come in words: the only place of its sentences."""

from collections.abc import Iterator
from dataclasses import replace

from hdcal.fleets.fleet_facts import FleetFacts
from hdcal.fleets.force.answer import ForceAnswer
from hdcal.fleets.next_force import NextForce
from hdcal.report.document import (
    Document,
    Picture,
    Section,
    Table,
    Text,
    mapped,
    notices,
)
from hdcal.report.words import capital, estimate, number, percent

WHOSE = (
    "Whose {load}s these are: single readings of gears of this kind that were not "
    "measured, each on a new mounting, at the reference temperature. That some of them "
    "are off is in them."
)
BEYOND = (
    "The {displacement} is larger than any that was read: that {load}s go on along a "
    "straight line is assumed, it was not measured."
)


def force_words(found: NextForce) -> Iterator[str]:
    """Yield what a gear to come needs at the deformation that was asked for."""
    yield from map(found.units.say, _force_words(found))


def _force_words(found: NextForce) -> Iterator[str]:
    middle, span = estimate(found.force_N)
    width = found.force_N.hi - found.force_N.lo
    sized = " of the gear file's sizes" * found.at_one_size
    limit, beyond = found.limit_force_N, found.probability_exceeded
    if limit is not None and beyond is not None:
        middle_, low, high = map(_few, vars(beyond).values())
        yield (
            f"{middle_} of gears to come{sized} need more than {limit:g} {{N}} at "
            f"{found.deformation_mm:g} {{mm}}, 95 % credible interval {low} … {high}."
        )
    many = "; ".join(
        f"{shown(each.content)} need at most {number(each.at_most_N, width)} {{N}}"
        for each in found.bounds
    )
    sure = shown(found.bounds[0].confidence)
    yield (
        f"At {found.deformation_mm:g} {{mm}} the next gear{sized} needs {middle} "
        f"{{N}}, 95 % "
        f"predictive interval {span} {{N}}, in one reading on a new mounting; with "
        f"{sure} "
        f"confidence {many}."
    )


def _few(share: float) -> str:
    """Return a share of gears: of thousands of them less than a hundredth counts."""
    if share >= 0.01:
        return percent(share)
    return f"{100.0 * share:.1g} %" if share >= 1e-4 else "< 0.01 %"


def force_document(found: NextForce) -> Document:
    """Return what the force of gears to come says by itself; its picture is force."""
    first, *others = force_words(found)
    document = Document(
        name="Gears to come",
        kind="margin",
        subtitle=_subtitle(found),
        headline=first,
        answers=[*others, WHOSE],
        notices=notices(("Outside what was tested", [BEYOND] * found.beyond_tested)),
        sections=[_bounds(found)],
    )
    return mapped(document, found.units.say)


def whole_document(
    found: ForceAnswer, facts: FleetFacts, command: str = ""
) -> Document:
    """Return the report of a force, with whose it is and how it was made.

    Args:
        found: the answer.
        facts: what the fleet's draws rest on.
        command: that asked.
    """
    settings, alone = facts.settings, force_document(found)
    sampled = (
        f"{settings.sampler}, {settings.chains} chains of {settings.draws} draws, seed "
        f"{settings.seed}"
    )
    rows = [
        ("fleet", facts.name),
        ("SHA-256 of the data", facts.data_sha256),
        ("sampling", sampled),
        ("versions", ", ".join(f"{k} {v}" for k, v in found.versions.items())),
    ]
    return replace(
        alone,
        name=facts.name,
        subtitle=f"{_subtitle(found)}, from {facts.gears} gears, {facts.rows} readings",
        notices=[
            *alone.notices,
            *notices(("What the fleet was told with", found.notes)),
        ],
        provenance=rows + ([("command", command)] if command else []),
    )


def shown(share: float) -> str:
    """Return a share that was asked for as people write it."""
    return f"{100.0 * share:.6g} %"


def _subtitle(found: NextForce) -> str:
    return found.units.say(
        f"{capital(found.units.load)} that gears to come need at "
        f"{found.deformation_mm:g} {{mm}}"
    )


def _bounds(found: NextForce) -> Section:
    width = found.force_N.hi - found.force_N.lo
    numbers = ["share of gears", "confidence", "at least [{N}]", "at most [{N}]"]
    rows = [
        [
            shown(each.content),
            shown(each.confidence),
            number(each.at_least_N, width),
            number(each.at_most_N, width),
        ]
        for each in found.bounds
    ]
    picture = Picture(
        "force",
        f"{capital(found.units.load)} of the next gear, and the bounds that many keep",
        "The next gear with its 95 % predictive interval; then the bounds that many "
        "gears keep, by the share of them and the confidence: 99/95.",
    )
    words = (
        "Each bound is one-sided, and holds by itself with its confidence: both "
        "together promise less."
    )
    table = Table(numbers, rows, frozenset(numbers))
    return Section("Bounds", [picture, table, Text(words, soft=True)], brief=True)
