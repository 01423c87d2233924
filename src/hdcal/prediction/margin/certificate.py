"""The certificate of a margin: what a person signs, on one printed page."""

import re
from collections.abc import Iterator
from datetime import date

from hdcal.data.gear_file.certificates import ZEROS, is_stated
from hdcal.data.measurements.notes import ASSUMED
from hdcal.inference.posterior import Posterior
from hdcal.prediction.margin.answer import MarginAnswer
from hdcal.prediction.margin.budget import CERTIFIED
from hdcal.prediction.margin.budget_words import stated_words
from hdcal.prediction.margin.document import budget_table
from hdcal.prediction.margin.sentences import measurand
from hdcal.report.document import (
    Block,
    Document,
    Facts,
    Section,
    Sentences,
    Text,
    mapped,
)
from hdcal.report.html import html_page
from hdcal.report.provenance import data_rows, gear_rows
from hdcal.report.words import capital, hypothesis

FILE, TEMPLATE = "certificate.html", "certificate.html.j2"
_UNTESTED = "What was not tested, and what the result rests on"
# Letters of a name in the title; the whole of it stands below.
_LONGEST = 60
# How a note goes on to say how it could be otherwise.
_OTHERWISE = re.compile(r"\. (?:If|For|Name|Its) ")
# What certificates of the rig may state, by site of the model.
_OF_GAUGES = {
    "force_gain": "gain of the load cell",
    "deformation_gain": "gain of the displacement gauge",
    "temperature_offset": "zero of the thermometer",
    "force_offset": "zero of the load cell",
    "deformation_offset": "zero of the displacement gauge",
}
_METHOD = (
    "Bayesian calibration of the {{load}} model with the readings; uncertainty by the "
    "law of propagation (JCGM 100) and by Monte Carlo (JCGM 101), which are compared; "
    "hdcal {version}, seed {seed}"
)


def certificate_page(found: MarginAnswer, posterior: Posterior, issued: date) -> str:
    """Return the certificate as the text of an HTML file.

    Args:
        found: the margin.
        posterior: of the likeliest cause.
        issued: date of issue.

    Raises:
        NotUsable: the calibration failed its checks.
    """
    return html_page(certificate(found, posterior, issued), {}, TEMPLATE)


def certificate(found: MarginAnswer, posterior: Posterior, issued: date) -> Document:
    """Return the certificate; arguments are those of `certificate_page`.

    Raises:
        NotUsable: the calibration failed its checks.
    """
    posterior.require_usable()
    name = found.gear.name or found.data.name
    document = Document(
        name=name if len(name) <= _LONGEST else f"{name[:_LONGEST]}…",
        kind="certificate",
        subtitle="Calibration of a model from measurements. No accreditation, such as "
        "that of ISO/IEC 17025, is claimed by it.",
        headline=f"{capital(measurand(found))} at {found.deformation_mm:g} {{mm}}: "
        f"{stated_words(found)}",
        sections=[
            Section("What was measured, and with what", [_measured(posterior)]),
            Section("Conditions and method", [_asked(found)]),
            Section("Uncertainty budget", _budget(found)),
            *_decision(found),
            Section(_UNTESTED, [Sentences(list(_untested(found, posterior)))]),
        ],
        provenance=[("date of issue", issued.isoformat()), ("signature", "")],
    )
    return mapped(document, found.units.say)


def _measured(posterior: Posterior) -> Facts:
    case = posterior.case
    words = {True: "part of the model: ", False: "not stated, so no part of U: "}
    known = {name: name in posterior.draws for name in CERTIFIED}
    known |= {name: True for name in ZEROS if is_stated(case.gear.priors[name])}
    parts = []
    for stated, said in words.items():
        listed = [_OF_GAUGES[name] for name, one in known.items() if one is stated]
        if listed:
            parts.append(said + ", ".join(listed))
    apart = {"case", "gear", "SHA-256 of the data"}
    gear = dict(gear_rows(case, posterior.theory))
    sizes = [f"{name} {words}" for name, words in gear.items() if name not in apart]
    read = dict(data_rows(case))
    units = case.units
    names = units.displacement, units.load, "temperature", "force read in steps of"
    seen = [
        f"{name} {read[name]}" for name in (*names, "runs", "gears") if name in read
    ]
    rows = [
        ("gear", "; ".join([gear["gear"], *sizes])),
        ("readings", "; ".join([gear["case"], f"{read['rows']} rows", *seen])),
        ("SHA-256 of the data", case.data_sha256),
        ("certificates of the rig", "; ".join(parts)),
    ]
    guessed = [note for note in case.notes if note.startswith(ASSUMED)]
    if guessed:
        # How to say otherwise is for whoever reads the file, not for who signs.
        said = (_OTHERWISE.split(note.removeprefix(ASSUMED))[0] for note in guessed)
        rows.append(("assumed", "; ".join(said)))
    return Facts(rows)


def _asked(found: MarginAnswer) -> Facts:
    warm = f"{found.worst.temperature_C:g} °C"
    if len(found.levels) > 1:
        ends = [level.temperature_C for level in found.levels]
        warm += f", the worst of {min(ends):g} … {max(ends):g} °C"
    what = "{load} that the gauge of this rig shows"
    if found.quantity == "load":
        what = "load on the gear, without the gauge's zero and errors"
    way = {"up": "loading", "down": "unloading"}[found.direction]
    method = {"version": found.versions["hdcal"], "seed": found.seed}
    sizes = "; ".join(f"{n} ± {t:g}" for n, t in found.tolerances_mm.items())
    rows = [
        ("measurand", what),
        (
            "conditions",
            f"{found.deformation_mm:g} {{mm}} as read, {way}, {warm}",
        ),
        ("whose", found.population_words),
        _model(found),
        ("method", _METHOD.format(**method)),
    ]
    return Facts(rows + ([("tolerances", sizes)] if sizes else []))


def _model(found: MarginAnswer) -> tuple[str, str]:
    """Return which model was taken for right, or over which causes was averaged."""
    if len(found.causes) == 1:
        (name,) = found.causes
        effects = "alone" if name == "none" else f"with {hypothesis(name)}"
        return "model", f"the {{load}} model {effects}, taken for right"
    causes = ", ".join(
        f"{hypothesis(name)} ({100.0 * chance:.0f} %)"
        for name, chance in found.causes.items()
    )
    return "cause of the gap", causes


def _budget(found: MarginAnswer) -> list[Block]:
    blocks: list[Block] = [budget_table(found, brief=True)] if found.budget else []
    check = found.linear_check
    return blocks + ([Text(check.words, soft=True)] if check is not None else [])


def _decision(found: MarginAnswer) -> Iterator[Section]:
    if found.decision is not None:
        words = Text(found.decision.words), Text(found.decision.rule_words, soft=True)
        yield Section("Decision and its rule", words)


def _untested(found: MarginAnswer, posterior: Posterior) -> Iterator[str]:
    yield from found.extrapolated
    place = capital(found.units.displacement)
    if not found.extrapolated and "temperature" in posterior.case.records.known:
        yield f"{place}, temperature and direction lie within what was tested."
    elif not found.extrapolated:
        yield f"{place} and direction lie within what was tested."
        yield "The temperature of the test was not measured: the reference is assumed."
    if found.population != "specimens":
        yield "Other gears: nothing here says how much they differ from this one."
    if found.population == "readings":
        yield "Other mountings: nothing here says how much they differ."
    yield from map(capital, found.remarks)
