"""The reports of a wave generator and of an inverse design."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict

from hdcal.design.answer import (
    CandidateAnswer,
    DesignAnswer,
    GeneratorAnswer,
    InverseAnswer,
)
from hdcal.design.sentences import generator_words, inverse_details, nearness
from hdcal.report.document import (
    Document,
    Facts,
    Notice,
    Picture,
    Section,
    Table,
    Text,
    notices,
)
from hdcal.report.parameters import Interval
from hdcal.report.provenance import THEORY_WORDS
from hdcal.report.words import estimate, unit

HEADINGS = {
    "material": "material",
    "wall_thickness_mm": "wall thickness [mm]",
    "radius_mm": "radius [mm]",
    "length_mm": "length [mm]",
    "load_height_mm": "load height [mm]",
    "deformation_mm": "deformation [mm]",
    "temperature_C": "temperature [°C]",
}
_BALANCE = (
    "Left: force of gear and spring over deformation; they rest where the lines cross. "
    "Right: probability that the gear stays in the window at all temperatures. A soft "
    "spring holds the force, so that every gear finds its own deformation; a stiff one "
    "holds the deformation, and passes on every error of its own."
)
_LIMIT = (
    "Force over the free sizes, the limit, and the design that keeps it with the least "
    "change. Of three sizes and more, the first two at the chosen value of the others."
)
_PROFILE = (
    "The ring that two opposed loads deform: displacement, bending moment and stress "
    "over half a turn. Lines: closed form; dots: the series cut after three terms."
)


def generator_document(found: GeneratorAnswer, command: str = "") -> Document:
    """Return the report of a wave generator; its pictures are design and profile."""
    sections = [
        _about(found.population),
        picture("design", "Spring and gear", _BALANCE),
        picture("profile", "Shape, moment and stress", _PROFILE),
        _by_temperature(found),
        _asked(asdict(found.asked)),
    ]
    return design_document(
        found, "elastic wave generator", list(generator_words(found)), sections, command
    )


def inverse_document(found: InverseAnswer, command: str = "") -> Document:
    """Return the report of an inverse design; its pictures are design and profile."""
    free = [picture("design", "Force and limit", _LIMIT)] if found.asked.bounds else []
    sections = [
        _about(found.population),
        *free,
        picture("profile", "Shape, moment and stress", _PROFILE),
        _candidates(found),
        _asked(asdict(found.asked) | _stress_limit(found)),
    ]
    words = [nearness(found), *inverse_details(found)]
    return design_document(found, "inverse geometry", words, sections, command)


def design_document(
    found: DesignAnswer,
    kind: str,
    answers: Sequence[str],
    sections: Sequence[Section],
    command: str,
) -> Document:
    """Return the report of a design or study.

    Args:
        found: tells the gear, what is taken for granted and what is extrapolated.
        kind: what it is.
        answers: sentences after the headline.
        sections: the evidence.
        command: how the result was made.
    """
    gear = found.gear
    prior = (
        "No gear was measured. Every number on this page is what is believed before "
        "any data."
    )
    facts = [
        ("gear", gear.name),
        ("material", gear.material),
        ("theory", f"{gear.theory} ({THEORY_WORDS.get(gear.theory, '')})"),
        ("draws", f"{found.draws} of the {found.basis}"),
    ]
    return Document(
        name=gear.name,
        kind=kind,
        subtitle=f"{kind.capitalize()}, theory “{gear.theory}”.",
        headline=found.headline,
        answers=answers,
        next_steps=[] if found.next_step is None else [found.next_step],
        notices=[
            *notices(
                ("Prior only", [prior] if found.basis == "prior" else []),
                ("To be aware of", found.warnings),
            ),
            Notice("What this takes for granted", found.assumptions, "good"),
        ],
        sections=sections,
        provenance=facts + ([("command", command)] if command else []),
    )


def picture(name: str, heading: str, caption: str) -> Section:
    """Return a section of one picture."""
    return Section(heading, [Picture(name, heading, caption)])


def band(found: DesignAnswer) -> str:
    """Return what the intervals are called."""
    return f"{100 * found.interval:g} % {found.interval_kind}"


def _about(population: str) -> Section:
    return Section("About", [Text(population)], brief=True)


def _by_temperature(found: GeneratorAnswer) -> Section:
    rows = [
        [
            f"{force.temperature_C:g} °C",
            *map(_with_span, (force.at_lo, force.at_middle, force.at_hi)),
            *(f"{p:.4g}" for p in (place.zero_backlash, place.no_jam, place.inside)),
        ]
        for force, place in zip(found.force_N, found.at_temperature, strict=True)
    ]
    low, high = found.asked.window_mm
    numbers = [
        f"force at {low:g} mm [N]",
        "in the middle [N]",
        f"at {high:g} mm [N]",
        "no backlash",
        "no jam",
        "inside",
    ]
    table = Table(["temperature", *numbers], rows, frozenset(numbers))
    words = f"Median, below it {band(found)}; probabilities with one set point for all."
    return Section("By temperature", [table, Text(words, soft=True)])


def _with_span(interval: Interval) -> str:
    return "\n".join(estimate(interval))


def _candidates(found: InverseAnswer) -> Section:
    names = list(found.asked.bounds)
    listed = [] if found.as_tested else [("tested gear", found.tested)]
    chosen = "chosen, as tested" if found.as_tested else "chosen"
    listed += [
        (chosen if one == found.design else "considered", one)
        for one in found.candidates
    ]
    numbers = [
        *(HEADINGS[name] for name in names),
        "force [N]",
        "keeps the limit",
        "stress [MPa]",
        "of yield",
    ]
    table = Table(
        ["", "material", *numbers, "met"],
        [[what, *_candidate(one, names)] for what, one in listed],
        frozenset(numbers),
    )
    note = Text(f"Median, below it {band(found)}.", soft=True)
    return Section("Designs", [table, note])


def _candidate(one: CandidateAnswer, names: Sequence[str]) -> list[str]:
    sizes = [one.sizes_mm.get(name.removesuffix("_mm")) for name in names]
    used = one.utilisation
    return [
        one.material,
        *("as tested" if size is None else f"{size:.4g}" for size in sizes),
        _with_span(one.force_N),
        f"{one.probability:.4g}",
        _with_span(one.stress_MPa),
        "–" if used is None else f"{100 * used.median:.3g} %",
        "yes" if one.met else "no",
    ]


def _stress_limit(found: InverseAnswer) -> dict[str, str]:
    """Return what the stress was kept below where no limit was asked for."""
    strength = found.design.yield_MPa
    if found.asked.limit_stress_MPa is not None or strength is None:
        return {}
    middle, span = estimate(strength)
    spread = f" ({span})" if strength.hi > strength.lo else ""
    return {"limit_stress_MPa": f"{middle}{spread}, the yield strength"}


def _asked(asked: Mapping[str, object]) -> Section:
    rows = [(_name(name), _value(value)) for name, value in asked.items()]
    return Section("What was asked", [Facts(rows)])


def _name(name: str) -> str:
    words, _, last = name.rpartition("_")
    if last not in ("mm", "C", "N", "MPa"):
        return name.replace("_", " ")
    return f"{words.replace('_', ' ')} [{unit(last)}]"


def _value(value) -> str:
    if value is None:
        return "–"
    if isinstance(value, str):
        return value
    if isinstance(value, Mapping):
        ranges = (f"{n.replace('_', ' ')} {_value(v)}" for n, v in value.items())
        return "; ".join(ranges) or "–"
    if isinstance(value, tuple):
        return " … ".join(f"{v:g}" for v in value)
    return f"{value:g}"
