"""Chart of prior and posterior densities."""

from typing import Any

import numpy as np
from arviz_stats.base.array import array_stats

from hdcal.inference.distributions import frozen
from hdcal.inference.posterior import Posterior
from hdcal.report.charts.chart_spec import (
    BLUE,
    INK,
    ORANGE,
    Band,
    Chart,
    Line,
    Mark,
    Panel,
)
from hdcal.report.posterior_result import unit_of
from hdcal.report.words import label, unit


def prior_chart(posterior: Posterior) -> Chart:
    """Return prior and posterior density of every parameter."""
    panels = [_density_panel(posterior, name) for name in posterior.diagnoses]
    return Chart(panels=panels, columns=2, static=True)


def _density_panel(posterior: Posterior, name: str) -> Panel:
    shown, factor = unit_of(posterior, name)
    draws = posterior.draws[name]
    prior: Any = frozen(posterior.effective_priors[name], name)
    from_data = posterior.diagnoses[name].driven_by == "data"
    marks: list[Mark] = []
    # Without the long tails of the prior.
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
        title="driven by the data" if from_data else "driven by the prior",
        marks=[*marks, line],
        y_limits=(0.0, 1.08),
        y_ticks=False,
        height=1.7,
    )
