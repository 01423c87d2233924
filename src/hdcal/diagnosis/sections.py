"""Sections of a diagnosis' report: where the gap lies, which effect, how far."""

from collections.abc import Iterator, Sequence

from hdcal.diagnosis.answer import VerdictAnswer
from hdcal.diagnosis.cause_words import held_out
from hdcal.diagnosis.gap import Cell, Gap
from hdcal.diagnosis.verdict import Closure
from hdcal.diagnosis.words import one_reading
from hdcal.quantities import Quantities
from hdcal.report.axes import load_axis
from hdcal.report.document import (
    Block,
    Facts,
    Picture,
    Section,
    Sentences,
    Table,
    Text,
)
from hdcal.report.words import (
    estimate,
    hypothesis,
    known,
    likely,
    load,
    number,
    or_zero,
    percent,
    percent_span,
)

_MOST_ROWS = 12


def seen_section(found: VerdictAnswer) -> Section:
    """Return what the readings show, whatever its cause."""
    heading = "What is seen"
    if not found.seen:
        words = "Nothing of what readings of this program can show stands out."
        return Section(heading, [Text(words)])
    rows = [
        [
            each.statement,
            *estimate(each.size_N),
            number(each.p_value),
            "yes" if each.material else "no",
        ]
        for each in found.seen
    ]
    numbers = (f"size [{found.units.load_unit}]", "95 % interval", "p")
    note = (
        "Size: from the lowest to the highest place of what slope and zero cannot take "
        "up. Intervals hold all together; p counts all that was looked for. The "
        "clearest comes first; each was found in what larger ones leave. It matters "
        f"from a thousandth of the largest {found.units.load} on."
    )
    table = Table(["seen", *numbers, "matters"], rows, frozenset(numbers))
    return Section(heading, [table, Text(note, soft=True)], brief=True)


def where_section(found: VerdictAnswer) -> Section:
    """Return where the gap lies; its picture is called where."""
    units = found.units
    facts = Table(["", "found", "meaning"], _gap_rows(found), frozenset({"found"}))
    caption = (
        f"Bars: mean of measured minus calibrated {units.load} in ranges chosen before "
        "looking. Blue shade: how far noise alone would move them, in 95 % of all "
        "programs for all ranges together. Red or orange: off. Thin line or green: "
        "gap. In the running sums noise stays in the grey band, a gap keeps its course."
    )
    shows = f"Measured minus calibrated {units.load} over everything that was measured"
    picture = Picture("where", shows, caption, tall=True)
    shares = ", ".join(
        f"{percent_span(each.share)} with {units.name(each.covariate)}"
        for each in found.where.shares
    )
    varies = [Text(f"The gap varies {shares}.")] if shares else []
    regions = _regions(found.where.regions, units)
    return Section("Where the gap lies", [facts, picture, *regions, *varies])


def _gap_rows(found: VerdictAnswer) -> list[tuple[str, str, str]]:
    gap, p = found.gap, found.where.p_value
    chance = f"p = {number(p)}"
    words = "a gap is seen" if gap.detected else "no gap is seen"
    seen = ("seen", chance, f"{words}; how often noise alone looks like this")
    if known(gap.rounding_N):
        steps = f"in steps of {load(gap.rounding_N, found.units)}"
        seen = ("seen", "rounding", f"{steps}; nothing else is seen ({chance})")
    noise = f"standard deviation of {one_reading(found)}"
    return [
        seen,
        ("probability", percent(gap.probability), "that anything is missing"),
        *_size_rows(gap, found.units),
        ("noise", load(gap.noise_sd_N, found.units), noise),
    ]


def _size_rows(gap: Gap, units: Quantities) -> list[tuple[str, str, str]]:
    if not known(gap.rms_N.median):
        return [("size", "–", "of what is not seen there is no size")]
    middle, span = estimate(gap.rms_N)
    share, unit = percent(gap.share_of_full_scale), units.load_unit
    return [
        ("size", f"{middle} {unit}", f"root mean square; 95 % interval {span} {unit}"),
        ("of full scale", share, f"size over the largest {units.load} tested"),
    ]


def _regions(regions: Sequence[Cell], units: Quantities) -> Iterator[Block]:
    if not regions:
        yield Text("No range is off by more than noise alone would make it.")
        return
    distance = load_axis(units, "measured − model")
    numbers = ("rows", distance, "in standard errors", "share of the gap")
    rows = [_region_row(cell, units) for cell in regions[:_MOST_ROWS]]
    yield Table(["off", "in", *numbers], rows, frozenset(numbers))
    hidden = len(regions) - _MOST_ROWS
    if hidden > 0:
        yield Text(f"{hidden} more are in the verdict itself.", soft=True)


def _region_row(cell: Cell, units: Quantities) -> list[str]:
    bias = cell.bias_N
    width = bias.hi - bias.lo if known(bias.hi) else None
    return [
        units.name(cell.covariate),
        cell.label,
        str(cell.rows),
        number(bias.median, width),
        number(cell.z, 10.0),
        percent(cell.share),
    ]


def which_section(found: VerdictAnswer) -> Section:
    """Return which effect causes it; its picture is called which."""
    which = found.which
    chances, evidence = which.probabilities, which.log_evidence
    together = likely(chances)
    ranked = sorted(chances, key=lambda name: -or_zero(chances[name]))[:_MOST_ROWS]
    rows = [
        [hypothesis(name), percent(chances[name]), number(evidence.get(name), 10.0)]
        for name in ranked
    ]
    numbers = ("probability", "log evidence over no gap")
    strong = frozenset(i for i, name in enumerate(ranked) if name in together)
    table = Table(["hypothesis", *numbers], rows, frozenset(numbers), strong=strong)
    others = len(chances) - _MOST_ROWS
    rest = f"{others} less probable ones are left out here. " if others > 0 else ""
    note = (
        f"Bold: the fewest that make up 90 %. {rest}An effect stands here alone; the "
        "answer's percentage counts all that hold it. Log evidence in nats: three are "
        "a factor of twenty. Something outside the library also counts what may last "
        "in what looks like noise, and what stands beside an effect that carries too "
        "little of the gap."
    )
    caption = (
        "Every hypothesis was weighed against the same data. “Something outside the "
        "library” is a free shape; it wins where no effect fits."
    )
    picture = Picture("which", "Probability of each hypothesis", caption)
    robust = list(_robustness(found))
    more = [Sentences(robust)] if robust else []
    blocks = [picture, table, Text(note, soft=True), *more]
    return Section("Which effect causes it", blocks)


def _robustness(found: VerdictAnswer) -> Iterator[str]:
    which = found.which
    if which.sensitivity:
        texts = [
            f"{percent(value)} ({name.replace('_', ' ')})"
            for name, value in which.sensitivity.items()
        ]
        yield (
            "With other beliefs about the size of effects, the first cause would have "
            f"{', '.join(texts)}."
        )
    if known(which.stability):
        share = percent(which.stability)
        yield f"With other readings of the same kind, the ranking's top stays: {share}."


def shrink_section(shrink: Closure, units: Quantities) -> Section:
    """Return how far the gap shrinks; its picture is called shrink."""
    caption = (
        "Left: what each model leaves over (root mean square). Right: how much of the "
        "gap is closed on readings that were not used in fitting. A free curve with as "
        "many parameters is the placebo: an effect should do better, above all where "
        f"the largest {units.displacement}s are held out."
    )
    shows = (
        "Root mean square of measured minus model, from the nominal model to the noise"
    )
    picture = Picture("shrink", shows, caption)
    closed = (
        Text(f"Not computed: {shrink.reason}.")
        if shrink.closed is None
        else Facts(list(_closed_rows(shrink, units)))
    )
    return Section("How far the gap shrinks", [picture, closed])


def _closed_rows(shrink: Closure, units: Quantities) -> Iterator[tuple[str, str]]:
    if shrink.closed is not None:
        yield f"closed on {held_out(shrink)}", percent_span(shrink.closed)
    if known(shrink.extrapolated_closed):
        share = percent(shrink.extrapolated_closed)
        yield f"with the largest {units.displacement}s held out", share
    if known(shrink.placebo_closed):
        share = percent(shrink.placebo_closed)
        yield "by a free curve instead (placebo)", share
    for name, share in shrink.bars.items():
        yield f"by {hypothesis(name)}", percent(share)
    if shrink.remainder_N is not None:
        middle, span = estimate(shrink.remainder_N)
        unit = units.load_unit
        yield "left after it", f"{middle} {unit}, 95 % interval {span} {unit}"
