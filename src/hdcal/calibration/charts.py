"""Charts of a calibration: readings with bands, and residuals."""

from collections.abc import Iterator

import numpy as np

from hdcal.calibration.check.charts import left_out
from hdcal.data.loading import movement_words
from hdcal.inference.force_model.residuals import Residuals
from hdcal.inference.posterior import Posterior
from hdcal.prediction.bands.charts import band_marks, branch_marks, branches
from hdcal.prediction.bands.result import Bands
from hdcal.report.charts.axes import displacement_axis, load_axis
from hdcal.report.charts.chart_spec import (
    GREY,
    INK,
    Chart,
    Panel,
    Points,
    Rule,
    Span,
    ascending_colours,
)
from hdcal.screening.result import DROPPED, OUTSIDE

_MOST_COLUMNS = 3
# Segments that are part of the curve; an outlier would flatten the picture.
_PARTS_OF_CURVE = (DROPPED, OUTSIDE)
# Marker of each direction, and its colour where colours show nothing else.
_MARKERS = {1: ("^", INK), -1: ("v", GREY)}


def calibration_chart(posterior: Posterior, bands: Bands, left: Residuals) -> Chart:
    """Return force over deformation, and below it the distance from the fit.

    The bands are over the tested range, at one or more temperatures.
    """
    gear, gap = posterior.case.gear, posterior.problem.discrepancy
    axis, units = displacement_axis(posterior.case), posterior.case.units
    levels = np.unique(bands.temperature_C)
    colours = ascending_colours(len(levels))
    warmth, place = left.records.temperature, left.records.deformation
    nearest = np.argmin(np.abs(np.asarray(warmth)[:, None] - levels), axis=1)
    distance = _distance_from_model(bands, left)
    reach = _reach(bands, distance)
    top, panels, found = [*band_marks(bands)], [], posterior.case.screening
    if found is not None:
        top += left_out(found, _PARTS_OF_CURVE)
    for index, (level, colour) in enumerate(zip(levels, colours, strict=True)):
        here = nearest == index
        points = "" if len(levels) == 1 else colour
        top += _readings(left, place, left.records.force, here, points, "measured")
        marks = [
            mark
            for branch in branches(bands)
            # Around their medians both directions have the same bands, unless the
            # discrepancy differs between them.
            if branch.temperature == level
            and (branch.loading or (gap is not None and gap.looped))
            for mark in branch_marks(bands, branch, around_model=True)
        ]
        panels.append(
            Panel(
                x=axis,
                y=load_axis(units, "measured − model"),
                title="residual" if len(levels) == 1 else f"at {level:g} °C",
                marks=[
                    *marks,
                    Rule(at=0.0),
                    *_readings(left, place, distance, here, points),
                ],
                y_limits=(-reach, reach),
                height=2.3,
            )
        )
    title = f"{gear.name}: {units.load} as read"
    load = load_axis(units)
    first = Panel(x=axis, y=load, title=title, marks=top, wide=True, height=4.6)
    columns = min(len(levels), _MOST_COLUMNS)
    return Chart(panels=[first, *panels], columns=columns, share_x=True, share_y=True)


def _distance_from_model(bands: Bands, left: Residuals) -> np.ndarray:
    """Return the distance of each reading from the force model alone [N]."""
    distance = left.residual.copy()
    gap = bands.with_gap_median_N - bands.physics_median_N
    if not np.isfinite(gap).any():
        return distance
    # The discrepancy is a part of the fit, and does not depend on the temperature.
    curves = {bands.direction[b.rows[0]]: b.rows for b in branches(bands)}
    for direction, rows in curves.items():
        rising = (left.records.sense >= 0.0) == (direction == "up")
        here = rising if len(curves) > 1 else slice(None)
        place = left.records.deformation[here]
        distance[here] += np.interp(place, bands.deformation_mm[rows], gap[rows])
    return distance


def _reach(bands: Bands, distance: np.ndarray) -> float:
    """Return the largest distance of a reading or a band in the tested range [N]."""
    inside, middle = np.asarray(bands.tested, bool), bands.straight_N
    ends = bands.new_measurement_lo_N, bands.new_measurement_hi_N
    edges = [distance, *((end - middle)[inside] for end in ends)]
    reach = 1.12 * float(np.max(np.abs(np.concatenate(edges))))
    return reach if np.isfinite(reach) and reach > 0.0 else 1.0


def _readings(
    left: Residuals, x, y, here: np.ndarray, colour: str = "", label: str = ""
) -> Iterator[Points]:
    """Yield some rows as points, each direction with its marker."""
    x, y, sense = map(np.asarray, (x, y, left.records.sense))
    read = np.asarray(left.records.deformation)
    words = movement_words(read - left.contact, left.units.displacement)
    for sign, (marker, usual) in _MARKERS.items():
        rows = here & (sense == sign)
        if rows.any():
            yield Points(
                label=f"{label}, {words[sign]}" if label else "",
                x=x[rows],
                y=y[rows],
                colour=colour or usual,
                marker=marker,
            )


def residual_chart(left: Residuals) -> Chart:
    """Return standardised residuals over deformation, order and temperature."""
    units, y, rows = left.units, left.standardised, left.records
    every = np.full(len(y), True)
    places = {
        f"{units.displacement} as read [{units.displacement_unit}]": rows.deformation,
        "row of the data": np.arange(1.0, len(every) + 1.0),
    }
    if np.ptp(rows.temperature) > 0.0:
        places["temperature [°C]"] = rows.temperature
    reach = max(3.0, 1.1 * float(np.max(np.abs(y))))
    frame = [Span(low=-2.0, high=2.0, label="±2 sd"), Rule(at=0.0)]
    panels = [
        Panel(
            x=axis,
            y="(measured − fit) / sd",
            marks=[*frame, *_readings(left, x, y, every, label="measured")],
            y_limits=(-reach, reach),
            wide=True,
            height=2.5,
            legend_beside=True,
        )
        for axis, x in places.items()
    ]
    return Chart(panels=panels)
