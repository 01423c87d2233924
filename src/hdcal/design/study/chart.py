"""A study as a chart: the force over the size that was varied first."""

import numpy as np

from hdcal.design.document import HEADINGS
from hdcal.design.study.study import Study
from hdcal.report.chart import COLOURS, Chart, Series


def study_chart(found: Study) -> Chart:
    """Return the median force and its interval, a curve for each of what else varied.

    Of more than six curves some, evenly.
    """
    columns, total = found.columns, len(found.columns["force_median_N"])
    along = next((name for name in found.varied if name != "material"), None)
    x = np.arange(1.0, total + 1.0) if along is None else columns[along]
    others = [name for name in found.varied if name != along and along is not None]
    keys = [tuple(columns[name][row] for name in others) for row in range(total)]
    each = list(dict.fromkeys(keys))
    kept = np.linspace(0, len(each) - 1, min(len(each), len(COLOURS)))
    curves: list[Series] = []
    between: list[tuple[int, int, float]] = []
    for place, colour in zip(kept.round().astype(int), COLOURS, strict=False):
        rows = np.array([row for row, key in enumerate(keys) if key == each[place]])
        rows = rows[np.argsort(x[rows], kind="stable")]
        named = "".join(map(_named, others, each[place]))
        between.append((len(curves), len(curves) + 1, 0.2))
        for end in ("hi", "lo"):
            y = columns[f"force_{end}_N"][rows]
            label = f"{100.0 * found.interval:g} % interval{named}, {end} [N]"
            curves.append(Series(label, x[rows], y, colour, width=0.0))
        middle = columns["force_median_N"][rows]
        curves.append(Series(f"median{named} [N]", x[rows], middle, colour))
    return Chart(HEADINGS[along] if along else "design", "force [N]", curves, between)


def _named(name: str, value) -> str:
    """Return what a curve is called by one size, with its unit, or by its material."""
    if name == "material":
        return f", {value}"
    word, _, unit = HEADINGS[name].partition(" [")
    return f", {word} {value:g} {unit.rstrip(']')}"
