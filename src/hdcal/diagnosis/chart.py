"""A diagnosis as a chart: what the calibrated model leaves, and the gap in it."""

import math

import numpy as np

from hdcal.diagnosis.verdict import Verdict
from hdcal.report.chart import COLOURS, Chart, Series
from hdcal.report.words import or_zero


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
    x = np.asarray(verdict.where.records.deformation)
    points = (
        ("measured − model [N]", verdict.where.residual_N, ""),
        ("the gap [N]", verdict.where.gap_N, COLOURS[1]),
    )
    series = [
        Series(label, x, np.asarray(y), colour, points=True)
        for label, y, colour in points
        if len(y) == len(x)
    ]
    return Chart("deformation as read [mm]", "measured − model [N]", series)
