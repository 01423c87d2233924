"""Charts of draws: posterior against prior, and the mixing of the chains."""

import math
from typing import Any

import numpy as np
from arviz_stats.base.array import array_stats
from scipy.stats import rankdata

from hdcal.inference.distributions import frozen
from hdcal.inference.posterior import Posterior
from hdcal.inference.posterior_tree import group_of
from hdcal.report.charts.chart_spec import (
    BLUE,
    CYCLE,
    INK,
    ORANGE,
    Band,
    Chart,
    Line,
    Mark,
    Panel,
    Rule,
    Span,
)
from hdcal.report.parameters import unit_of
from hdcal.report.words import label, unit

_COLUMNS, _BINS = 2, 20


def prior_chart(posterior: Posterior) -> Chart:
    """Return prior and posterior density of every parameter."""
    panels = [_density_panel(posterior, name) for name in posterior.diagnoses]
    return Chart(panels=panels, columns=_COLUMNS)


def _density_panel(posterior: Posterior, name: str) -> Panel:
    shown, factor = unit_of(posterior, name)
    draws = posterior.draws[name]
    prior: Any = frozen(posterior.effective_priors[name], name)
    from_data = posterior.diagnoses[name].driven_by == "data"
    marks: list[Mark] = []
    # Without the prior's long tails the posterior has room.
    low, high = prior.ppf([0.005, 0.98])
    reach = 0.2 * float(np.ptp(draws))
    if reach > 0.0:
        least, most = prior.support()
        ends = max(least, draws.min() - reach), min(most, draws.max() + reach)
        x, density, _ = array_stats.kde(draws, bound_correction=True, custom_lims=ends)
        low, high = min(low, x[0]), max(high, x[-1])
        marks.append(
            Band(
                label="posterior",
                x=x * factor,
                low=np.zeros(len(x)),
                high=density / density.max(),
                colour=BLUE if from_data else ORANGE,
                opacity=0.45,
            )
        )
    x = np.linspace(low, high, 300)
    density = prior.pdf(x)
    peak = np.max(density[np.isfinite(density)], initial=1e-300)
    line = Line(
        label="prior",
        x=x * factor,
        y=np.minimum(density / peak, 1.0),
        colour=INK,
        dash="dashed",
        width=1.0,
    )
    name = label(name, posterior.theory, posterior.case.units)
    return Panel(
        x=f"{name} [{unit(shown)}]" if unit(shown) else name,
        y="",
        title="driven by the data" if from_data else "prior-dominated",
        marks=[*marks, line],
        y_limits=(0.0, 1.08),
        y_ticks=False,
        height=1.7,
    )


def rank_chart(posterior: Posterior) -> Chart:
    """Return the ranks of each chain's draws; chains that agree are level."""
    draws = group_of(posterior.tree, "posterior")
    panels = [
        _rank_panel(
            draws[name].values,
            f"rank of the draw (R-hat {found.rhat:.3f})",
            label(name, posterior.theory, posterior.case.units),
        )
        for name, found in posterior.diagnoses.items()
    ]
    return Chart(panels=panels, columns=_COLUMNS, share_y=True)


def _rank_panel(draws: np.ndarray, axis: str, title: str) -> Panel:
    """Return the panel of one parameter, from draws of shape (chain, draw)."""
    ranks = rankdata(draws, method="ordinal", axis=None).reshape(draws.shape) - 0.5
    bins = max(2, min(_BINS, draws.shape[1] // 5))
    edges = np.linspace(0.0, draws.size, bins + 1)
    even = draws.shape[1] / bins
    # Two standard deviations of the binomial count of a chain that agrees.
    chance = 2.0 * math.sqrt((1.0 - 1.0 / bins) / even)
    counts = [np.histogram(each, bins=edges)[0] / even for each in ranks]
    lines = [
        Line(x=edges, y=count, colour=colour, width=1.0, steps=True)
        for count, colour in zip(counts, CYCLE * len(counts), strict=False)
    ]
    return Panel(
        x=axis,
        y="count / even count",
        title=title,
        marks=[Span(low=1.0 - chance, high=1.0 + chance), Rule(at=1.0), *lines],
        y_limits=(0.0, max(2.0, 1.05 * float(np.max(counts)))),
        height=1.7,
    )
