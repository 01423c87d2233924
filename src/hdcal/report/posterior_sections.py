"""Sections of reports about a sampled posterior: parameters, checks, priors."""

import math
from collections.abc import Mapping, Sequence

from hdcal.inference.checks import Check
from hdcal.inference.diagnostics import CLEAR_CONTRACTION, MIN_CONTRACTION
from hdcal.inference.posterior import Posterior
from hdcal.quantities import FORCE, Quantities
from hdcal.report.document import Picture, Section, Table, Tag, Text, Tone
from hdcal.report.parameters import ParameterEstimate
from hdcal.report.words import estimate, label, percent, prior_words, unit

_OUTCOMES: Mapping[str, Tone] = {
    "passed": "good",
    "note": "neutral",
    "warning": "caution",
    "failed": "bad",
}
_DRIVERS: Mapping[str, Tone] = {"data": "good", "prior": "caution"}
PARAMETER_NOTE = Text(
    "Intervals hold 95 % of the posterior, with equal tails. Driven by data: at least "
    f"{percent(MIN_CONTRACTION)} of the prior's variance are gone, or "
    f"{percent(CLEAR_CONTRACTION)} where power scaling finds the data weak and the "
    "prior not.",
    soft=True,
)
_PRIORS = Picture(
    "priors",
    "Posterior and prior density of every parameter",
    "What was believed before (dashed) and what is believed now (filled), each scaled "
    "to the same height. Where the two coincide, the data said nothing. “Gained from "
    "data” is the part of the prior's variance that the data removed.",
)
_SAMPLER = Picture(
    "sampler",
    "Rank plots of the chains",
    "Ranks of each chain's draws among all draws, one colour per chain: chains that "
    "found the same posterior stay level around one, mostly inside the grey band.",
)


def parameter_section(
    found: Mapping[str, ParameterEstimate], *, brief: bool = True
) -> Section:
    """Return the estimates with their figure, which is called priors."""
    blocks = [parameter_table(found), PARAMETER_NOTE, _PRIORS]
    return Section("Parameters", blocks, brief)


def parameter_table(
    found: Mapping[str, ParameterEstimate], units: Quantities = FORCE
) -> Table:
    """Return estimates as a table.

    Args:
        found: from `parameter_estimates`.
        units: names and units of what was measured.
    """
    gained, sizes = "gained from data", "ESS bulk / tail"
    columns = ["parameter", "median", "95 % interval", "unit", "driven by"]
    columns += [gained, "R-hat", sizes]
    rows = [
        [
            label(name, units=units),
            *estimate(one),
            unit(one.unit),
            driver_tag(one.driven_by),
            _known(max(one.contraction, 0.0), ".0%"),
            _known(one.rhat, ".3f"),
            f"{_known(one.ess_bulk, '.0f')} / {_known(one.ess_tail, '.0f')}",
        ]
        for name, one in found.items()
    ]
    numbers = frozenset({"median", "95 % interval", gained, "R-hat", sizes})
    return Table(columns, rows, numbers, spare=frozenset({gained}))


def _known(value: float, form: str) -> str:
    return format(value, form) if math.isfinite(value) else "–"


def driver_tag(driver: str) -> Tag:
    """Return who decided a quantity: the data, the prior, or the user."""
    return Tag(driver, _DRIVERS.get(driver, "neutral"))


def check_section(checks: Sequence[Check]) -> Section:
    """Return what was checked, with the figure of the chains, called sampler."""
    columns = ["check", "outcome", "what was found"]
    rows = [
        [check.name, Tag(check.outcome, _OUTCOMES[check.outcome]), check.words]
        for check in checks
    ]
    table = Table(columns, rows, long=frozenset({"what was found"}))
    return Section("Checks", [table, _SAMPLER], appendix=True)


def prior_section(posterior: Posterior) -> Section:
    """Return what was believed of each parameter before the data, and why."""
    rows = [
        [label(name), prior_words(name, prior), prior.source or "the gear file"]
        for name, prior in posterior.priors.items()
        if name in posterior.draws
    ]
    columns = ["parameter", "believed before the data", "source"]
    table = Table(columns, rows, long=frozenset({"source"}))
    return Section("Priors", [table], appendix=True)
