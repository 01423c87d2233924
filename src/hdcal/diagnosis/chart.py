"""A diagnosis as a chart: what the calibrated model leaves, and the gap in it."""

import math
from collections.abc import Iterator

import numpy as np

from hdcal.diagnosis.gap import Cell
from hdcal.diagnosis.verdict import Verdict
from hdcal.quantities import Quantities
from hdcal.report.axes import covariate_axis, load_axis
from hdcal.report.canvas import thinned
from hdcal.report.chart import COLOURS, Chart, Series, boxes
from hdcal.report.words import or_zero

_NOISE = "what noise alone leaves (95 %)"


def hypothesis_columns(verdict: Verdict) -> dict[str, list]:
    """Return every hypothesis with its probability, the likeliest first."""
    chances, evidence = verdict.which.probabilities, verdict.which.log_evidence
    ranked = sorted(chances, key=lambda name: -or_zero(chances[name]))
    return {
        "hypothesis": ranked,
        "probability": [chances[name] for name in ranked],
        "log_evidence": [evidence.get(name, math.nan) for name in ranked],
    }


def verdict_chart(verdict: Verdict) -> Chart:
    """Return measured minus model over the deformation, with the gap at each row."""
    ranges, _ = verdict.where.by_covariate()
    return _over(verdict, "deformation", ranges["deformation"])


def where_charts(verdict: Verdict) -> tuple[Chart, ...]:
    """Return measured minus model over, or by, everything that was measured.

    The running sums come last.
    """
    ranges, names = verdict.where.by_covariate()
    units = verdict.case.units
    over = [_over(verdict, name, cells) for name, cells in ranges.items()]
    by = [_by(name, cells, units) for name, cells in names.items()]
    every = [*over, *by, *(_sum(drawn, units) for drawn in running_sums(verdict))]
    return tuple(chart for chart in every if chart.series)


def running_sums(
    verdict: Verdict,
) -> Iterator[tuple[str, np.ndarray, np.ndarray, float]]:
    """Yield what rows are sorted by, its values, the running sum [N], and its reach.

    That is how far the sum of noise alone goes, in 95 % of programs [N].
    """
    residual = np.nan_to_num(np.asarray(verdict.where.residual_N))
    deformation = np.asarray(verdict.where.records.deformation)
    order = np.argsort(deformation, kind="stable")
    # 1.36 is the 95 % point of a Brownian bridge's largest excursion (Kolmogorov).
    memory = min(max(verdict.gap.autocorrelation, 0.0), 0.98)
    stretch = math.sqrt((1.0 + memory) / (1.0 - memory))
    reach = 1.36 * verdict.gap.noise_sd_N * math.sqrt(len(residual)) * stretch
    axis = covariate_axis("deformation", "mm", verdict.case.units)
    yield axis, deformation[order], np.cumsum(residual[order]), reach
    row = np.arange(1.0, len(residual) + 1.0)
    yield "row of the data", row, np.cumsum(residual), reach


def _over(verdict: Verdict, name: str, cells: list[Cell]) -> Chart:
    """Return the residuals over a covariate, with the means of its ranges."""
    residual, gap = verdict.where.residual_N, verdict.where.gap_N
    units = verdict.case.units
    axis = load_axis(units, "measured − model")
    values = verdict.where.values_of(name)
    series, bands = _means(
        cells,
        np.array([cell.from_ for cell in cells]),
        np.array([cell.to for cell in cells]),
        units,
    )
    if values is not None:
        rows, values = thinned(len(residual)), np.asarray(values)
        points = [(axis, residual, "#8a949c")]
        if name == "deformation":
            points.append((load_axis(units, "the gap"), gap, COLOURS[2]))
        series += [
            Series(label, values[rows], np.asarray(y)[rows], colour, points=True)
            for label, y, colour in points
            if len(y) == len(values)
        ]
    along = covariate_axis(name, cells[0].unit if cells else "mm", units)
    tall = 380 if name == "deformation" else 240
    return Chart(along, axis, series, bands, tall)


def _by(name: str, cells: list[Cell], units: Quantities) -> Chart:
    """Return the means of cells that have names."""
    place = np.arange(1.0, len(cells) + 1.0)
    means = _means(cells, place - 0.3, place + 0.3, units)
    axis = load_axis(units, "measured − model")
    names = [cell.label for cell in cells]
    return Chart(units.name(name), axis, *means, 380, names)


def _means(
    cells: list[Cell], starts: np.ndarray, stops: np.ndarray, units: Quantities
) -> tuple[list[Series], list[tuple[int, int, float]]]:
    """Return the mean of each cell, and how far noise alone would move it."""
    if not cells or not all(math.isfinite(cell.bias_N.hi) for cell in cells):
        return [], []
    order = np.argsort(starts, kind="stable")
    starts, stops = starts[order], stops[order]
    # A level is a range without width: it gets one that can be seen, no wider than the
    # next level is far.
    at = 0.5 * (starts + stops)
    near = np.min(np.diff(at), initial=np.inf)
    thin = min(0.02 * (float(np.max(stops) - np.min(starts)) or 1.0), 0.5 * near)
    starts, stops = np.minimum(starts, at - thin), np.maximum(stops, at + thin)
    stops[:-1] = np.minimum(stops[:-1], starts[1:])
    middle, high = (
        np.array([getattr(cells[k].bias_N, end) for k in order])
        for end in ("median", "hi")
    )
    hot = np.array([cells[k].hot for k in order])
    levels = [
        (load_axis(units, f"{_NOISE}, upper"), high - middle, COLOURS[0], 0.0),
        (load_axis(units, f"{_NOISE}, lower"), middle - high, COLOURS[0], 0.0),
        (load_axis(units, "mean"), np.where(hot, np.nan, middle), COLOURS[0], 2.0),
        (load_axis(units, "mean, off"), np.where(hot, middle, np.nan), COLOURS[1], 3.0),
    ]
    series = [
        Series(label, *boxes(starts, stops, level), colour, width=width)
        for label, level, colour, width in levels
        if width == 0.0 or np.isfinite(level).any()
    ]
    return series, [(0, 1, 0.16)]


def _sum(drawn: tuple[str, np.ndarray, np.ndarray, float], units: Quantities) -> Chart:
    along, x, total, reach = drawn
    rows, axis = thinned(len(total)), load_axis(units, "running sum")
    series = [Series(axis, x[rows], total[rows], COLOURS[0])]
    if not math.isfinite(reach):
        return Chart(along, axis, series, height=240)
    ends = np.array([x[0], x[-1]])
    for side, level in (("upper", reach), ("lower", -reach)):
        edge, label = np.full(2, level), load_axis(units, f"{_NOISE}, {side}")
        series.append(Series(label, ends, edge, "#8a949c", width=0.0))
    return Chart(along, axis, series, [(1, 2, 0.16)], 240)
