"""A calibration in words: the only place of its sentences."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import partial

from hdcal.calibration.answer import CalibrationAnswer, LocalStiffness
from hdcal.data.theory_names import SPRING, THEORY_WORDS
from hdcal.inference.checks import INDEPENDENT, NOISY, PLAUSIBLE
from hdcal.inference.posterior import Posterior
from hdcal.inference.residual_noise import NEIGHBOURS, SCATTER, WILD
from hdcal.inference.residuals import Residuals
from hdcal.report.document import (
    Document,
    Facts,
    Picture,
    Section,
    Sentences,
    Table,
    Text,
    notices,
)
from hdcal.report.parameters import Interval, measured
from hdcal.report.posterior_sections import (
    check_section,
    parameter_section,
    prior_section,
)
from hdcal.report.provenance import data_rows, provenance_rows
from hdcal.report.words import capital, estimate, label, number, with_labels

ARTICLE_NOTE = (
    "K under `article` is a ratio to that article's slope of 1625.19 N/mm, which no "
    "combination of its own inputs reproduces; its K = 0.13 is no property of the gear."
)
# Gears that a page shows at once.
_AT_ONCE = 10
# The shape that loading and unloading leave which differ.
LOOPED = "direction"
_IMPLAUSIBLE = (
    "First look at the units of the columns, and at sizes and [measurement] of the "
    "gear file: what comes out is not what such a gear is believed to be."
)
_ALIKE = (
    "Diagnose: errors of neighbours that are so alike may be a loop or a bend, which "
    "can shift the stiffness beyond its interval. A diagnosis weighs both."
)
_NOISE = (
    "Diagnose: there is more noise than such rigs have, and a diagnosis weighs what "
    "else it may be."
)
_EACH = (
    "Look at the gears one by one: the command `fleet` says which of them is off. What "
    "is said here is of their mean."
)
# Shape of the residuals -> what to do about it.
_REMEDY: Mapping[str, str] = {
    "end": "Take more readings near the largest deformation, loading and unloading.",
    LOOPED: "Diagnose: that weighs what can part loading from unloading, "
    "friction and hysteresis among it.",
    "temperature": "Diagnose: that weighs what a change of temperature does.",
    "temperature x deformation": "Check the prior of alpha for this material.",
    "time": "Diagnose: that weighs what drifts. Repeat the first point at the end.",
    "order": "Repeat the first point at the end: it tells drift from stiffness.",
    NEIGHBOURS: "Repeat the ramp in other mountings: their scatter tells what "
    "neighbours that err alike hide.",
    SCATTER: "Calibrate with the effect heteroscedastic_noise.",
    WILD: "Look at that reading first: if it is a slip, mend it or leave its row out; "
    "where such readings happen, calibrate with the effect outliers.",
}
# Covariate that was not measured -> what to do about it.
_LACKING: Mapping[str, str] = {
    "unloading": "Unload too: without it friction and hysteresis cannot be seen.",
    "specimen": "Measure a second gear: one gear says nothing about the next one.",
    "temperature": "Measure at a second temperature: only then do data speak of α.",
}


def headline(
    found: Interval,
    posterior: Posterior,
    bend: Sequence[LocalStiffness] = (),
    *,
    looped: bool = False,
    beside_a_loop: Interval | None = None,
) -> str:
    """Return the stiffness in one sentence.

    Args:
        found: of a straight line.
        posterior: whose it is; without temperatures it holds at that of the test.
        bend: its slope at several places, where the readings bend.
        looped: whether readings on loading and on unloading differ from it.
        beside_a_loop: stiffness of a model with a loop of any shape.
    """
    case, (middle, span) = posterior.case, estimate(found)
    # Three digits of each slope.
    slopes = " to ".join(
        f"{number(slope, slope)} N/mm at {each.deformation_mm:.2g} mm"
        for each in bend
        for slope in [each.stiffness_N_per_mm]
    )
    told = (
        f". That is a straight line; the readings bend, from {slopes}" if bend else ""
    )
    if looped and not bend:
        told = ". Loading and unloading differ from that line: "
        told += _beside(beside_a_loop) if beside_a_loop else "it may lie outside"
    was_read = "temperature" in case.records.known
    warm = f" at {case.gear.reference_temperature:g} °C" * was_read
    many = len(case.specimen_labels)
    whose = f"Mean stiffness of the {many} gears tested" if many > 1 else "Stiffness"
    acting = [e.name for e in posterior.effects if e.stage != "noise"]
    whose += f" apart from {' and '.join(acting).replace('_', ' ')}" * bool(acting)
    return (
        f"{whose}{warm}: {middle} N/mm, 95 % credible interval {span} N/mm, per "
        f"millimetre as read{told}."
    )


def _beside(found: Interval) -> str:
    middle, span = estimate(found)
    return f"beside a loop of any shape it is {middle} ({span}) N/mm"


def next_steps(posterior: Posterior, left: Residuals) -> list[str]:
    """Return what would make the answer better, most urgent first."""
    if not posterior.usable:
        return [
            "Do not use this result. Calibrate with more warm-up and draws; if it "
            "still fails, look at the data and leave effects out."
        ]
    known = posterior.case.records.known
    warned = {check.name for check in posterior.checks if check.outcome == "warning"}
    steps = [_IMPLAUSIBLE] * (PLAUSIBLE in warned)
    steps += [_REMEDY[s.name] for s in left.noise if s.name == WILD]
    steps += [_EACH] * ("specimens" in known)
    steps += [_ALIKE] * (INDEPENDENT in warned and "unloading" in known)
    remedies = {**_REMEDY, "curvature": _bend_remedy(known)}
    steps += [remedies[shape.name] for shape in (*left.structure, *left.noise)]
    steps += [_NOISE] * (NOISY in warned and not left.structure)
    steps += [words for name, words in _LACKING.items() if name not in known]
    return list(dict.fromkeys(steps))


def _bend_remedy(known: Collection[str]) -> str:
    """Return what separates causes of curvature and was not done."""
    steps = {
        "unload as well as load": "unloading" not in known,
        "take finer steps at small deformation": True,
        "re-seat the gear and repeat": "run" not in known,
    }
    open_ones = [step for step, left in steps.items() if left]
    *first, last = open_ones
    told = f"{', '.join(first)} or {last}" if first else last
    each = "each separates" if first else "this separates"
    return f"{capital(told)}: {each} some causes of curvature."


def calibration_document(
    posterior: Posterior, found: CalibrationAnswer, command: str = ""
) -> Document:
    """Return the report: pictures calibration, priors, residuals and sampler."""
    effects = ", ".join(found.effects).replace("_", " ")
    said = partial(with_labels, names=found.parameters)
    return Document(
        name=posterior.case.gear.name,
        kind="calibration",
        subtitle=f"Calibration of the force model from {found.data.rows} readings "
        f"({found.data.name}), theory “{found.gear.theory}”"
        f"{', with ' * bool(effects)}{effects}.",
        # Of a failed calibration the page shows it struck through.
        headline=headline(
            found.stiffness_N_per_mm,
            posterior,
            found.bend,
            looped=LOOPED in {shape.name for shape in found.residuals},
            beside_a_loop=found.beside_a_loop,
        ),
        answers=list(_answers(found)),
        next_steps=found.next_steps,
        notices=[
            *notices(("To be aware of", said(found.warnings))),
            *notices(("Remarks", said(found.flat_directions)), tone="neutral"),
        ],
        sections=[
            *_specimens(found),
            _bands(found),
            parameter_section(measured(found.parameters, found.gear.theory)),
            *_theories(found),
            _residuals(found),
            check_section(found.checks),
            Section("Data", [Facts(data_rows(posterior.case))], appendix=True),
            prior_section(posterior),
        ],
        provenance=provenance_rows(posterior, command),
        failed=found.reasons,
        failed_words="The sampler did not pass its checks, so every number and band on "
        "this page may be wrong.",
    )


def _answers(found: CalibrationAnswer) -> Iterator[str]:
    if found.gear.theory != SPRING:
        middle, span = estimate(found.parameters["K"])
        yield (
            f"Influence coefficient under “{found.gear.theory}”: K = {middle}, 95 % "
            f"credible interval {span}."
        )
    for driver, words in (
        ("data", "Decided by the data"),
        ("prior", "Not decided without the prior"),
    ):
        names = [
            label(name)
            for name, one in measured(found.parameters, found.gear.theory).items()
            if one.driven_by == driver
        ]
        if names:
            yield f"{words}: {', '.join(names)}."


def _specimens(found: CalibrationAnswer) -> Iterator[Section]:
    if not found.specimens:
        return
    rows = [[name, *estimate(own)] for name, own in found.specimens.items()]
    titles = ["gear", "N/mm", "95 % interval"]
    table = Table(titles, rows, frozenset(titles[1:]), page=_AT_ONCE)
    yield Section("The gears", [table], brief=len(rows) <= _AT_ONCE)


def _bands(found: CalibrationAnswer) -> Section:
    gap = "; middle band: the same with the leftover discrepancy" * found.with_gap
    return Section(
        "Data and bands",
        [
            Picture(
                "calibration",
                "Measured force over deformation with the bands of the calibrated "
                "model",
                f"Inner band: where the force model lies with 95 % probability{gap}. "
                "Outer band: where one new reading lies with 95 % probability. "
                "Hatched and dotted: outside what was tested. The numbers are in "
                "bands.csv.",
            )
        ],
    )


def _theories(found: CalibrationAnswer) -> Iterator[Section]:
    if found.gear.theory == SPRING:
        return
    names = list(found.K_by_theory)
    rows = []
    for name, K in found.K_by_theory.items():
        used = " (used here)" * (name == found.gear.theory)
        texts = ("–", "–") if K is None else estimate(K)
        rows.append([name, f"{THEORY_WORDS.get(name, '')}{used}", *texts])
    table = Table(
        ["theory", "", "K", "95 % interval"],
        rows,
        numbers=frozenset({"K", "95 % interval"}),
        strong=frozenset({names.index(found.gear.theory)}),
    )
    one = (
        "Data identify the stiffness only, that is K times the theory's stiffness; the "
        "rows are one posterior seen through each theory."
    )
    blocks = [table, Text(one), Text(found.K_note)]
    yield Section("K under each theory", blocks, appendix=True)


def _residuals(found: CalibrationAnswer) -> Section:
    shapes = [
        f"{one.words} (p = {one.p_value:.2g}, adjusted for all shapes tried)"
        for one in found.residuals
    ]
    none = Text("No shape was found in them that pure noise would rarely show.")
    picture = Picture(
        "residuals",
        "Standardised residuals over deformation and in the order of the rows",
        "Distance of each reading from the fit in units of the noise; about one in "
        "twenty lies outside the grey band when the model is right.",
    )
    return Section("Residuals", [Sentences(shapes) if shapes else none, picture])
