"""A fleet in words: the only place of its sentences."""

from collections.abc import Iterator, Mapping

import numpy as np

from hdcal.fleets.answer import FleetAnswer
from hdcal.fleets.curves import shown_gears
from hdcal.fleets.fleet import Fleet
from hdcal.fleets.force.document import BEYOND, force_words
from hdcal.fleets.gauge_words import gauge_section
from hdcal.fleets.notes import FEW
from hdcal.fleets.time_words import time_section, time_words
from hdcal.report.document import (
    Document,
    Facts,
    Picture,
    Section,
    Sentences,
    Table,
    Tag,
    Text,
    mapped,
    notices,
)
from hdcal.report.words import capital, estimate, number, percent

# Gears in the table of a page, and of those that are shown at once; all of them are in
# gears.csv.
MOST_LISTED, _AT_ONCE = 10_000, 25


def fleet_document(
    found: Fleet, answer: FleetAnswer, columns: Mapping[str, np.ndarray], command: str
) -> Document:
    """Return the report; its pictures are called gears, curves and time."""
    settings = found.settings
    sampled = f"{settings['chains']} chains of {settings['draws']} draws"
    sampled = f"{settings['sampler']}, {sampled}"
    versions = ", ".join(f"{k} {v}" for k, v in answer.versions.items())
    provenance = [
        ("SHA-256 of the data", answer.data_sha256),
        ("sampling", f"{sampled}, seed {settings['seed']}"),
        ("versions", versions),
    ]
    document = Document(
        name=found.case.name,
        kind="fleet",
        subtitle=f"{answer.gears} gears, {answer.rows} readings",
        headline=answer.headline,
        answers=list(_answers(answer)),
        next_steps=[answer.next_step] if answer.next_step else [],
        notices=notices(
            ("Outside what was tested", [BEYOND] * _beyond(answer)),
            ("To be aware of", answer.notes),
        ),
        sections=[
            _gears(columns, answer),
            _curves(found),
            _scatter(answer),
            *([time_section(answer.over_time)] if answer.over_time else []),
            gauge_section(answer.gauge_rr),
            Section(
                "Checks", [Sentences([c.words for c in found.checks])], False, True
            ),
        ],
        provenance=provenance + ([("command", command)] if command else []),
        failed=found.reasons,
    )
    return mapped(document, answer.units.say)


def _beyond(answer: FleetAnswer) -> bool:
    return answer.next_force is not None and answer.next_force.beyond_tested


def _answers(answer: FleetAnswer) -> Iterator[str]:
    # What changes with the date has a say in all that follows.
    yield from (time_words(one) for one in answer.over_time if one.changed)
    if answer.next_force is not None:
        yield from force_words(answer.next_force)
    middle, span = estimate(answer.population.stiffness_N_per_mm)
    yield (
        f"Centre of the ordinary gears: {middle} {{N/mm}}, 95 % credible interval "
        f"{span} {{N/mm}}, per {answer.units.per} as read."
    )
    middle, span = estimate(answer.next_gear.stiffness_N_per_mm)
    sized = " of the gear file's sizes" * answer.at_one_size
    told = f"The next gear{sized}: {middle} {{N/mm}}, 95 % predictive interval {span} "
    told += "{N/mm}"
    also = "; that it may be an odd one is in it" * bool(answer.off_in["stiffness"])
    yield f"{told}{also}."
    if answer.gears < FEW:
        yield (
            f"{answer.gears} gears say too little for bounds on most gears to come: "
            "these would rest on what was believed before."
        )
        return
    one = answer.next_gear.stiffness_N_per_mm
    width = one.hi - one.lo
    ends = [
        f"at least {percent(each.content)} are stiffer than "
        f"{number(each.stiffer_than_N_per_mm, width)} {{N/mm}}, and at least "
        f"{percent(each.content)} softer than "
        f"{number(each.softer_than_N_per_mm, width)} {{N/mm}}"
        for each in answer.next_gear.bounds
    ]
    sure = percent(answer.next_gear.bounds[0].confidence)
    told = "; ".join(ends)
    yield f"Of gears to come, each bound by itself with {sure} confidence: {told}."


def _gears(columns: Mapping[str, np.ndarray], answer: FleetAnswer) -> Section:
    far = np.lexsort([-columns["probability_off"], ~columns["called_off"]])
    far = far[:MOST_LISTED]
    numbers = [
        "{N/mm}",
        "95 % interval",
        "apart [%]",
        "P(off)",
        "in sds",
        "noise [{N}]",
    ]
    numbers += ["rows"]
    rows = [_gear(columns, int(row)) for row in far]
    titles = ["gear", "", *(["lot"] if "lot" in columns else []), *numbers]
    table = Table(titles, rows, frozenset(numbers), page=_AT_ONCE)
    shown = Picture(
        "gears",
        "Stiffness of every gear with its interval",
        "Each gear's stiffness with its 95 % credible interval, from the softest to "
        "the stiffest. The numbers are in gears.csv.",
    )
    listed = f"The oddest {MOST_LISTED} are listed. " * (answer.gears > MOST_LISTED)
    more = [Text(f"{listed}All of them are in gears.csv.", soft=True)]
    more *= answer.gears > _AT_ONCE
    called = (
        "Apart: from the centre, of its lot where lots are told, at one size; in sds: "
        "counted in the scatter of ordinary gears; P(off): in stiffness. Called off "
        "are those so far out, in stiffness, noise, zero or shape, that in the mean at "
        f"most {percent(answer.false_calls)} of the gears called are ordinary ones."
    )
    blocks = [shown, table, *more, Text(called, soft=True)]
    return Section("The gears, the oddest first", blocks, brief=True)


def _curves(found: Fleet) -> Section:
    """Return the readings, and whose are shown."""
    shown, off = shown_gears(found), int(found.called.sum())
    few, ordinary = len(shown.ordinary), len(found.called) - off
    whose = f"all {few}" if few == ordinary else f"{few} of {ordinary}, evenly chosen"
    words = f"Grey: ordinary gears, {whose}."
    named = len(shown.called)
    whose = f"all {off}" if named == off else f"{named} of {off}"
    words += f" In colours: gears that are called off, {whose}." * bool(named)
    words += " Each is of its own size." * found.at_one_size
    units = found.case.units
    what = (
        f"{capital(units.load)} over {units.displacement} of many gears, those called "
    )
    what += "off in colours"
    return Section("The readings", [Picture("curves", what, words)])


def _gear(columns: Mapping[str, np.ndarray], row: int) -> list[str | Tag]:
    one = {name: column[row] for name, column in columns.items()}
    low, high = one["stiffness_lo"], one["stiffness_hi"]
    width = high - low
    return [
        str(one["gear"]),
        Tag(f"off: {one['off_in']}", "caution") if one["called_off"] else "",
        *([str(one["lot"])] if "lot" in one else []),
        number(one["stiffness_N_per_mm"], width),
        f"{number(low, width)} … {number(high, width)}",
        _signed(one["apart_percent"], 10.0 * (one["apart_hi"] - one["apart_lo"])),
        percent(one["probability_off"]),
        f"{one['distance_sd']:+.1f}",
        number(one["noise_sd_N"], 10.0 * one["noise_sd_N"]),
        str(one["rows"]),
    ]


def _signed(value: float, width: float) -> str:
    return ("+" if value > 0.0 else "") + number(value, width)


def _scatter(answer: FleetAnswer) -> Section:
    population = answer.population
    rows = [
        ("between lots", population.lot_sd_percent, "%"),
        ("between ordinary gears", population.gear_sd_percent, "%"),
        ("gain, between rigs", population.rig_sd_percent, "%"),
        ("zero, between operators", population.operator_sd_N, "{N}"),
        ("zero, between mountings", population.mounting_sd_N, "{N}"),
        ("single readings", population.reading_sd_N, "{N}"),
    ]
    told = [
        (what, f"{estimate(one)[0]} {unit} ({estimate(one)[1]})")
        for what, one, unit in rows
        if one is not None
    ]
    heading = "What scatters, sd with 95 % interval"
    return Section(heading, [Facts(told), *_groups(answer)], brief=True)


def _groups(answer: FleetAnswer) -> Iterator[Table]:
    """Yield what is known of each lot, operator and rig."""
    lots = [
        [one.lot, str(one.gears), *estimate(one.stiffness_N_per_mm)]
        for one in answer.lots
    ]
    operators = [
        [one.operator, str(one.mountings), *estimate(one.zero_apart_N)]
        for one in answer.operators
    ]
    rigs = [
        [one.rig, str(one.mountings), *estimate(one.gain_apart_percent)]
        for one in answer.rigs
    ]
    for title, many, what, rows in (
        ("lot", "gears", "{N/mm}", lots),
        ("operator", "mountings", "zero over the mean [{N}]", operators),
        ("rig", "mountings", "gain over the mean [%]", rigs),
    ):
        numbers = (many, what, "95 % interval")
        if rows:
            yield Table([title, *numbers], rows, frozenset(numbers))
