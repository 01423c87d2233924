"""Figures of the draws: posterior against prior, and how the chains mixed."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hdcal.inference.distributions import frozen
from hdcal.inference.posterior import Posterior
from hdcal.inference.posterior_tree import group_of
from hdcal.report.canvas import (
    BLUE,
    CYCLE,
    DARK,
    GREY,
    ORANGE,
    plain,
    style,
    watermark,
)
from hdcal.report.parameters import unit_of
from hdcal.report.words import label, unit

_COLUMNS = 3
_BINS = 20


def prior_figure(posterior: Posterior) -> Figure:
    """Draw the posterior of every parameter over its prior."""
    names = list(posterior.diagnoses)
    with style():
        figure, panels = _grid(len(names), 2.05)
        for axes, name in zip(panels, names, strict=True):
            _draw_prior(axes, posterior, name)
        panels[0].legend(loc="upper right")
        if not posterior.usable:
            watermark(figure)
    return figure


def _grid(count: int, height: float) -> tuple[Figure, list[Axes]]:
    rows = math.ceil(count / _COLUMNS)
    figure = Figure(figsize=(7.6, height * rows), layout="constrained")
    panels = list(figure.subplots(rows, _COLUMNS, squeeze=False).flat)
    for spare in panels[count:]:
        spare.remove()
    return figure, panels[:count]


def _draw_prior(axes: Axes, posterior: Posterior, name: str) -> None:
    found = posterior.diagnoses[name]
    believed = frozen(posterior.effective_priors[name], name)
    shown, factor = unit_of(posterior, name)
    after = posterior.draws[name]
    # The prior's long tails would squeeze everything else into one bin.
    low, high = believed.ppf([0.005, 0.98])
    start, stop = np.quantile(after, [0.001, 0.999])
    colour = BLUE if found.driven_by == "data" else ORANGE
    x, height = _density(after, (min(low, start), max(high, stop)))
    axes.fill_between(x * factor, height, color=colour, alpha=0.45, linewidth=0.0)
    axes.plot(x * factor, height, color=colour, linewidth=1.2, label="posterior")
    before = believed.pdf(x)
    line = {"color": DARK, "linewidth": 1.0, "linestyle": "--", "label": "prior"}
    peak = np.max(before[np.isfinite(before)], initial=1e-300)
    axes.plot(x * factor, before / peak, **line)
    axes.set_ylim(0.0, 1.08)
    axes.set_yticks([])
    axes.grid(False)
    axes.spines["left"].set_visible(False)
    axes.locator_params(axis="x", nbins=4)
    axes.set_xlabel(plain(_axis(name, shown), 44), fontsize=8.5)
    words = f"driven by {found.driven_by}"
    axes.set_title(words, color=colour, fontsize=8.5, loc="left", fontweight="bold")


def _axis(name: str, shown: str) -> str:
    return f"{label(name)} [{unit(shown)}]" if unit(shown) else label(name)


def _density(values: np.ndarray, edges: tuple[float, float]):
    """Return a smoothed histogram, scaled to a peak of one."""
    count, ends = np.histogram(values, bins=400, range=edges)
    middle = 0.5 * (ends[1:] + ends[:-1])
    # Silverman's rule, by the part of the draws that is not tail.
    lower, upper = np.quantile(values, [0.25, 0.75])
    spread = min(float(np.std(values)), float(upper - lower) / 1.35)
    width = 0.9 * spread * len(values) ** -0.2 / (middle[1] - middle[0])
    if not np.isfinite(width) or width < 0.5:
        return middle, count / max(int(count.max()), 1)
    reach = int(min(4 * width, 398)) + 1
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    # Mirrored at both ends: half of a density at a bound must not leak away.
    padded = np.pad(count.astype(float), reach, mode="symmetric")
    height = np.convolve(padded, kernel / kernel.sum(), mode="valid")
    return middle, height / max(float(height.max()), 1e-300)


def sampler_figure(posterior: Posterior) -> Figure:
    """Draw rank plots: chains that agree are level everywhere."""
    names, drawn = [*posterior.diagnoses], group_of(posterior.tree, "posterior")
    with style():
        figure, panels = _grid(len(names), 1.75)
        for axes, name in zip(panels, names, strict=True):
            _draw_ranks(axes, drawn[name].values)
            rhat = posterior.diagnoses[name].rhat
            words = plain(label(name), 40)
            axes.set_title(words, loc="left", fontsize=8, fontweight="bold")
            axes.set_xlabel(f"rank of the draw (R-hat {rhat:.3f})", fontsize=8)
        panels[0].set_ylabel("count / even count", fontsize=8)
        if not posterior.usable:
            watermark(figure)
    return figure


def _draw_ranks(axes: Axes, values: np.ndarray) -> None:
    chains, draws = values.shape
    ranks = np.argsort(np.argsort(values, axis=None)).reshape(chains, draws)
    bins = max(2, min(_BINS, draws // 5))
    edges = np.linspace(0.0, values.size, bins + 1)
    even = draws / bins
    # What equal chains leave to chance: two binomial standard deviations.
    chance = 2.0 * math.sqrt((1.0 - 1.0 / bins) / even)
    axes.axhspan(1.0 - chance, 1.0 + chance, color=GREY, alpha=0.18, linewidth=0.0)
    for chain, colour in zip(range(chains), CYCLE * chains, strict=False):
        height = np.histogram(ranks[chain], bins=edges)[0] / even
        axes.stairs(height, edges, baseline=None, color=colour, linewidth=1.0)
    axes.set_xticks([])
    axes.set_ylim(0.0, max(2.0, axes.get_ylim()[1]))
