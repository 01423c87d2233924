"""The pictures of the page "Which stiffness?", drawn from simulated readings."""

from pathlib import Path

import numpy as np
from sphinx.application import Sphinx

import hdcal
from hdcal.report.charts.chart_drawing import images
from hdcal.report.charts.chart_spec import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    Chart,
    Line,
    Mark,
    Panel,
    Points,
    Span,
)

# Tracked by git, so that the pages show their pictures without a build, too.
FOLDER = Path("_static")
_STIFFNESS = 20.0  # of the straight part [N/mm]
_X, _Y = "deformation [mm]", "force [N]"


def curve_with_a_toe() -> dict[str, np.ndarray]:
    """Return readings of a part that seats, is straight, and yields."""
    x = np.linspace(0.0, 6.0, 121)
    toe = np.where(x < 1.5, x**2 / 3.0, x - 0.75)
    force = _STIFFNESS * (toe - 0.8 * np.maximum(x - 4.5, 0.0) ** 1.1)
    noise = np.random.default_rng(1).normal(0.0, 0.3, x.size)
    return {"deformation_mm": x, "force_N": force + noise}


def toe_picture() -> Chart:
    """Return a curve with a toe and a yield, and four slopes of it."""
    readings = curve_with_a_toe()
    x, y = readings["deformation_mm"], readings["force_N"]
    screening = hdcal.read_case(readings).screening
    assert screening is not None and screening.straight is not None
    part = screening.straight
    slope = np.polyfit(x, y, 1)
    inside = np.array([part.low, part.high])
    middle = float(np.mean(inside))
    level = float(np.interp(middle, x, y))
    ends = [int(np.argmin(np.abs(x - place))) for place in (2.0, 4.0)]
    far = int(np.argmin(np.abs(x - 4.0)))
    marks: list[Mark] = [
        Span(low=part.low, high=part.high, axis="x", label="longest straight part"),
        Points(label="readings", x=x, y=y, colour=GREY),
        _line("line through all of it", slope[0], (0.0, slope[1]), (0.0, 6.0), ORANGE),
        _line("secant to 4 mm", y[far] / x[far], (0.0, 0.0), (0.0, 4.0), PURPLE),
        _line("straight part", part.slope, (middle, level), (0.6, 5.6), BLUE),
        Points(label="ends of a chord", x=x[ends], y=y[ends], colour=GREEN, marker="D"),
    ]
    panel = Panel(x=_X, y=_Y, marks=marks, height=3.6, legend_beside=True)
    return Chart(panels=[panel])


def loop_picture() -> Chart:
    """Return loading and unloading with friction, and the slopes of both."""
    up = np.linspace(0.0, 10.0, 41)
    x = np.concatenate([up, up[-2::-1]])
    state, force, last = 0.0, [], 0.0
    for place in x:
        # friction that builds up over 1 mm after each turn
        state = float(np.clip(state + (place - last) / 1.0, -1.0, 1.0))
        force.append(6.0 * place + 6.0 * state)
        last = place
    y = np.array(force) + np.random.default_rng(3).normal(0.0, 0.3, x.size)
    loading = np.arange(x.size) < up.size
    after = ~loading & (x > 8.5)
    steep = np.polyfit(x[after], y[after], 1)[0]
    straight = loading & (x > 1.5)
    slope, level = np.polyfit(x[straight], y[straight], 1)
    marks: list[Mark] = [
        Points(label="loading", x=x[loading], y=y[loading], marker="^"),
        Points(
            label="unloading", x=x[~loading], y=y[~loading], colour=GREY, marker="v"
        ),
        _line("slope of the branches", slope, (0.0, level), (0.0, 10.0), BLUE),
        _line(
            "just after the turn", steep, (10.0, y[up.size - 1]), (7.5, 10.0), ORANGE
        ),
    ]
    panel = Panel(x=_X, y=_Y, marks=marks, height=3.4, legend_beside=True)
    return Chart(panels=[panel])


def _line(
    label: str,
    slope: float,
    through: tuple[float, float],
    ends: tuple[float, float],
    colour: str,
) -> Line:
    x = np.array(ends)
    y = through[1] + slope * (x - through[0])
    return Line(label=f"{label}: {slope:.3g} N/mm", x=x, y=y, colour=colour)


PICTURES = {"toe": toe_picture, "loop": loop_picture}


def draw(app: Sphinx) -> None:
    """Draw all pictures before the pages are read."""
    folder = Path(app.srcdir) / FOLDER
    for name, picture in PICTURES.items():
        content = images(picture(), name, ("png",))["png"]
        (folder / f"{name}.png").write_bytes(content)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the pictures."""
    app.connect("builder-inited", draw)
    return {"parallel_read_safe": True}
