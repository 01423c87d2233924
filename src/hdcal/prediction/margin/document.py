"""The report of a margin: its sections, and what they rest on in sentences."""

from dataclasses import replace

from hdcal.inference.posterior import Posterior
from hdcal.prediction.margin.answer import MarginAnswer
from hdcal.prediction.margin.budget_words import coverage_words, stated_words
from hdcal.prediction.margin.number_words import chance, index, newtons
from hdcal.prediction.margin.result import Level, Margin
from hdcal.prediction.margin.sentences import (
    answer,
    bound_name,
    headline,
    in_tension,
    input_label,
    larger_bound,
    measurand,
    member_word,
    next_steps,
)
from hdcal.prediction.margin.temperatures import shown_levels
from hdcal.report.document import (
    Document,
    Picture,
    Section,
    Table,
    Tag,
    Text,
    mapped,
    notices,
)
from hdcal.report.intervals import Interval
from hdcal.report.provenance import gear_rows
from hdcal.report.words import capital, estimate, hypothesis, number

# A component with less of the variance than this is not shown by itself.
_SMALL = 1e-3
_TOGETHER = (
    "“Calibration” is stiffness, zeros, effects and leftover together, with their "
    "covariances; of K and E0 only the product matters. What the data say nothing of "
    "has a row of its own, with all that hangs on it."
)
CALIBRATION_SHARE = (
    "“Calibration” is stiffness, zeros, effects and leftover together: the data tie "
    "them to each other, so that they have no shares of their own; of K and E0 only "
    "the product matters. The loss of modulus per kelvin stands alone only where it "
    "is the prior's."
)


def margin_document(found: Margin) -> Document:
    """Return what a margin says by itself; its pictures are margin and tornado."""
    first = headline(found)
    sections = [_bounds(found)]
    if found.models:
        sections.append(_causes(found))
    if found.budget:
        sections += [_budget_section(found), _sensitivities(found)]
    if found.decision is not None:
        rule = Text(found.decision.rule_words, soft=True)
        blocks = [Text(found.decision.words), rule]
        title = f"Decision on one future {member_word(found)}"
        sections.append(Section(title, blocks, brief=True))
    document = Document(
        name="Margin",
        kind="margin",
        subtitle=_subtitle(found),
        headline=first,
        answers=[words for words in answer(found) if words != first],
        next_steps=list(next_steps(found)),
        notices=notices(
            ("Outside what was tested", found.extrapolated),
            ("To be aware of", found.remarks),
        ),
        sections=sections,
    )
    return mapped(document, found.units.say)


def whole_document(
    found: MarginAnswer, posterior: Posterior, command: str = ""
) -> Document:
    """Return the report of a margin, with whose it is and how it was made."""
    tolerances = ", ".join(
        f"{name} ± {size:g}" for name, size in found.tolerances_mm.items()
    )
    rows = [
        *gear_rows(posterior.case, posterior.theory),
        ("tolerances", tolerances or "none given"),
        ("seed", str(found.seed)),
        ("versions", ", ".join(f"{k} {v}" for k, v in found.versions.items())),
    ]
    data = found.data
    return replace(
        margin_document(found),
        name=found.gear.name,
        subtitle=f"{_subtitle(found)}, from {data.rows} readings ({data.name}), theory "
        f"“{found.gear.theory}”.",
        provenance=rows + ([("command", command)] if command else []),
    )


def _subtitle(found: Margin) -> str:
    words = f"{capital(found.units.load)} needed at {found.deformation_mm} "
    words += f"{found.units.displacement_unit} and the margin to it"
    return words


def _bounds(found: Margin) -> Section:
    bounds = bound_name(found)
    numbers = [
        "mean [{N}]",
        "one member [{N}]",
        "lower",
        "upper",
        "P",
        "β",
    ]
    shown = Picture(
        "margin",
        f"{capital(found.units.load)} needed with its bounds and the capacity",
        "Dark: where the mean {load} lies with 95 % probability. Light: where one "
        f"future member lies with 95 % probability. Arrows: the {bounds} bounds, "
        "one-sided each.",
    )
    words = (
        "Mean: 95 % credible interval. One member: 95 % predictive interval. P: "
        f"probability that one future member needs more{in_tension(found)} than the "
        f"capacity; β = −Φ⁻¹(P). Lower and upper: a {bounds} bound is one that "
        f"{100.0 * found.content:g} % of the population keep to, with "
        f"{100.0 * found.confidence:g} % confidence. Each is one-sided: both together "
        "promise less."
    )
    table = Table(
        ["°C", "tested", *numbers],
        [_level(level) for level in shown_levels(found.levels)],
        frozenset(["°C", *numbers]),
    )
    return Section("Bounds", [shown, table, Text(words, soft=True)])


def _level(level: Level) -> list[str | Tag]:
    risk = level.exceedance
    return [
        f"{level.temperature_C:g}",
        "yes" if level.tested else Tag("extrapolated", "caution"),
        _span(level.force_N),
        _span(level.member_N),
        newtons(level.lower_bound_N),
        newtons(level.upper_bound_N),
        "–" if risk is None else chance(risk.probability),
        "–" if risk is None else index(risk.beta),
    ]


def _span(span: Interval) -> str:
    return estimate(span)[1]


def _causes(found: Margin) -> Section:
    bounds, worst = bound_name(found), found.worst
    rows = [
        [
            hypothesis(model.model),
            f"{100.0 * model.probability:.0f} %",
            newtons(model.lower_bound_N),
            newtons(model.upper_bound_N),
        ]
        for model in found.models
    ]
    ends = newtons(worst.lower_bound_N), newtons(worst.upper_bound_N)
    numbers = ["probability", f"{bounds} lower", f"{bounds} upper"]
    table = Table(
        ["cause of the gap", *numbers],
        [*rows, ["averaged", "", *ends]],
        frozenset(numbers),
        strong=frozenset({len(rows)}),
    )
    return Section("The bound with each cause", [table])


def _sensitivities(found: Margin) -> Section:
    larger = larger_bound(found)
    shown = Picture(
        "tornado",
        "Shares of the budget, and the change of the bound for one per cent",
        "Left: shares of the variance of one future member's {load}, all at "
        f"{found.worst.temperature_C} °C. Right: change of the {larger} bound when an "
        "input grows by one per cent.",
    )
    per = "[{N} per unit]"
    slopes = [f"d bound / d input {per}", f"d mean / d input {per}"]
    numbers = ["at", *slopes, "bound for + 1 % [{N}]"]
    rows = [
        [
            input_label(slope.name),
            number(slope.value),
            {"E0_GPa": "GPa", "K": ""}.get(slope.name, "{mm}"),
            number(slope.bound_N),
            number(slope.force_N),
            f"{slope.bound_N_per_percent:+.2f}",
        ]
        for slope in found.gradients
    ]
    table = Table(["input", "at", "", *numbers[1:]], rows, frozenset(numbers))
    return Section("What the bound hangs on", [shown, table])


def _budget_section(found: Margin) -> Section:
    first = f"{capital(measurand(found))}: {stated_words(found)}"
    assert found.linear_check is not None
    notes = [Text(found.linear_check.words, soft=True), Text(_TOGETHER, soft=True)]
    blocks = [Text(first), budget_table(found), *notes]
    return Section("Uncertainty budget", blocks, brief=True)


def budget_table(found: Margin, *, brief: bool = False) -> Table:
    """Return the uncertainty budget.

    Args:
        found: the margin, with a budget.
        brief: without what would halve each row.
    """
    numbers = ["u", "{N} per unit", "{N}", "share"]
    columns = ["component", "type", "distribution", "u", "unit", *numbers[1:]]
    large = [line for line in found.budget if line.share >= _SMALL]
    small = [line for line in found.budget if line.share < _SMALL]
    rows = [
        [
            line.component,
            line.type,
            line.distribution,
            f"{line.standard_uncertainty:.3g}",
            line.unit,
            f"{line.sensitivity_N_per_unit:.4g}",
            f"{line.contribution_N:.3g}",
            f"{100.0 * line.share:.1f} %",
            line.halved_by,
        ]
        for line in large
    ]
    if small:
        rest = sum(line.contribution_N**2 for line in small) ** 0.5
        words = (
            f"{len(small)} smaller ones together" if small[1:] else "one smaller one"
        )
        share = f"{100.0 * sum(line.share for line in small):.2f} %"
        rows.append([words, *[""] * 5, f"{rest:.3g}", share, ""])
    assert found.linear_check is not None
    whole = f"{found.linear_check.standard_uncertainty_N:.3g}"
    law = "" if brief else f"; {coverage_words(found.linear_check)}"
    rows.append([f"combined{law}", *[""] * 5, whole, "100 %", ""])
    return Table(
        columns if brief else [*columns, "halved by"],
        [row[: len(columns)] if brief else row for row in rows],
        frozenset(numbers),
        spare=frozenset({"distribution"}),
        strong=frozenset({len(rows) - 1}),
    )
