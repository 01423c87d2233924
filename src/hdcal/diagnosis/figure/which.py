"""The figure of which effect causes the gap: one bar per hypothesis."""

import math
import textwrap

from matplotlib.figure import Figure

from hdcal.diagnosis.verdict import Verdict
from hdcal.report.canvas import BLUE, DARK, GREY, plain, style, watermark
from hdcal.report.words import hypothesis, likely, percent

_MOST = 8


def which_figure(verdict: Verdict) -> Figure:
    """Draw the most probable hypotheses, those that make up 90 % marked."""
    found = verdict.which.probabilities
    chances = {name: p if math.isfinite(p) else 0.0 for name, p in found.items()}
    together = likely(chances)
    ranked = sorted(chances, key=lambda name: -chances[name])[:_MOST]
    # Nothing missing, and something unforeseen, are answers that always count.
    names = [*ranked, *(n for n in ("none", "unknown") if n not in ranked)]
    with style():
        figure = Figure(figsize=(7.6, 0.9 + 0.34 * len(names)), layout="constrained")
        axes = figure.subplots()
        for place, name in enumerate(reversed(names)):
            colour = BLUE if name in together else GREY
            chance = chances.get(name, 0.0)
            axes.barh(place, chance, 0.68, color=colour)
            words = percent(chance)
            axes.text(chance + 0.012, place, words, va="center", color=DARK, size=8.5)
        texts = [_wrapped(hypothesis(name)) for name in reversed(names)]
        axes.set_yticks(range(len(names)), texts)
        axes.tick_params(axis="y", length=0)
        axes.set_xlim(0.0, 1.12)
        ticks = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]
        axes.set_xticks(ticks, [f"{100 * tick:.0f} %" for tick in ticks])
        axes.set_xlabel("probability (blue: the fewest that make up 90 %)")
        axes.grid(False, axis="y")
        if verdict.status != "ok":
            watermark(figure)
    return figure


def _wrapped(text: str) -> str:
    return "\n".join(textwrap.wrap(plain(text, 80), 34))
