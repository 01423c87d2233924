"""Charts of a gear in motion: deformation and force over time."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from hdcal.report.charts.chart_spec import (
    ORANGE,
    Band,
    Chart,
    Line,
    Panel,
    Points,
    Rule,
    beyond,
    drawn_rows,
)

# Rows of a curve that are drawn.
_MOST_ROWS = 10_000


def response_chart(motion: pd.DataFrame) -> Chart:
    """Return the band of the deformation and the force, from `Response.motion`."""
    table, time, axis = _drawn(motion)
    tested, marks = table.tested.to_numpy(), []
    for rows, words in ((tested, ""), (beyond(tested), ", not tested")):
        if rows.any():
            low, middle, high = (
                np.where(rows, table[f"deformation_{end}_mm"], np.nan)
                for end in ("lo", "median", "hi")
            )
            label, dash = f"95 % credible band{words}", "dotted" if words else "solid"
            hatched = bool(words)
            marks.append(Band(label=label, x=time, low=low, high=high, hatched=hatched))
            label = f"median{words}"
            marks.append(Line(label=label, x=time, y=middle, dash=dash, width=1.0))
    look = {"height": 3.6, "legend_beside": True}
    panel = Panel(x=axis, y="deformation [mm]", marks=[*marks, Rule(at=0.0)], **look)
    return Chart(panels=[panel, _force(table, time, axis)], share_x=True)


def motion_chart(bands: pd.DataFrame) -> Chart:
    """Return deformation, force and distance from the model, from `motion_bands`."""
    table, time, axis = _drawn(bands)
    middle = table.mean_median_mm.to_numpy()
    model = Line(label="median", x=time, y=middle, width=1.0)
    marks = [*_marks(table, time, 0.0), model]
    distance = [*_marks(table, time, middle), Rule(at=0.0)]
    deformation = Panel(x=axis, y="deformation as read [mm]", marks=marks, height=3.6)
    left = Panel(x=axis, y="measured − model [mm]", marks=distance, height=2.0)
    panels = [deformation, _force(table, time, axis), left]
    return Chart(panels=panels, share_x=True)


def _marks(table: pd.DataFrame, time: np.ndarray, centre) -> Iterator[Band | Points]:
    """Yield bands and readings, less a centre [mm]."""
    for name, label, opacity in (
        ("new_measurement", "one new reading, 95 %", 0.16),
        ("mean", "model, 95 % credible", 0.45),
    ):
        low, high = (table[f"{name}_{end}_mm"] - centre for end in ("lo", "hi"))
        ends = {"low": low.to_numpy(), "high": high.to_numpy()}
        yield Band(label=label, x=time, opacity=opacity, **ends)
    read = (table.deformation_mm - centre).to_numpy()
    rows = drawn_rows(read)
    yield Points(label="measured", x=time[rows], y=read[rows], marker=".")


def _force(table: pd.DataFrame, time: np.ndarray, axis: str) -> Panel:
    force = Line(x=time, y=table.force_N.to_numpy(), colour=ORANGE, width=1.2)
    return Panel(x=axis, y="force [N]", marks=[force, Rule(at=0.0)], height=1.6)


def _drawn(table: pd.DataFrame) -> tuple[pd.DataFrame, np.ndarray, str]:
    """Return the rows that are drawn, their times, and the label of these."""
    table = table.iloc[:: -(-len(table) // _MOST_ROWS)]
    time = table.time_s.to_numpy()
    if np.ptp(time) < 0.5:
        return table, 1e3 * time, "time [ms]"
    return table, time, "time [s]"
