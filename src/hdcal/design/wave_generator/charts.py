"""Charts of a wave generator: spring against gear, and the choice of the spring."""

from typing import TYPE_CHECKING

import numpy as np

from hdcal.report.chart_spec import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    RED,
    Band,
    Line,
    Mark,
    Panel,
    Points,
    Rule,
    Span,
)

if TYPE_CHECKING:
    from hdcal.design.wave_generator.generator_result import WaveGenerator

_TAILS = (0.025, 0.5, 0.975)
# Points along a curve.
_FINE = 41


def balance_panel(found: "WaveGenerator") -> Panel:
    """Return the force of gear and spring over the deformation."""
    asked, spring = found.asked, found.chosen
    (low, high), sense = asked.sizes_mm, asked.sense
    wide = high - low
    along = np.linspace(max(low - 1.5 * wide, 0.02 * low), high + 1.5 * wide, _FINE)
    along = np.sort(sense * along)
    # The coldest and the warmest temperature.
    levels = np.unique([asked.temperature_C[0], asked.temperature_C[-1]])
    bands = np.quantile(found.next_gear.forces(along, levels), _TAILS, axis=2)
    lo, hi = asked.window_mm
    window = Span(low=lo, high=hi, axis="x", label="window", colour=GREEN)
    marks: list[Mark] = [window]
    for index, (level, colour) in enumerate(zip(levels, (BLUE, ORANGE), strict=False)):
        lo, middle, hi = bands[:, :, index]
        label = f"gear at {level:g} °C, 95 %"
        marks += [
            Band(label=label, x=along, low=lo, high=hi, colour=colour),
            Line(label=label, x=along, y=middle, colour=colour),
        ]
    free_end = sense * spring.interference
    label = f"spring of {spring.rate:.4g} N/mm"
    force = spring.rate * (free_end - along)
    marks.append(Line(label=label, x=along, y=force, colour=INK, dash="dashed"))
    room = 0.1 * (bands.max() - bands.min())
    return Panel(
        title="Balance of spring and gear",
        x="radial deformation of the gear [mm]",
        y="force on each side [N]",
        marks=marks,
        y_limits=(float(bands.min() - room), float(bands.max() + room)),
        height=3.6,
    )


def probability_panel(found: "WaveGenerator") -> Panel:
    """Return the probability of the window over the spring rate."""
    curve, spring, required = found.curve, found.spring, found.asked.probability
    rates, common = np.array(curve.rate_N_per_mm), np.array(curve.common)
    adjusted = np.array(curve.adjusted)
    label = type(curve).label
    marks = [
        Line(label=label("common"), x=rates, y=common),
        Line(
            label=label("adjusted"), x=rates, y=adjusted, colour=ORANGE, dash="dashdot"
        ),
        Rule(at=required, label=f"required {required:g}", colour=RED, dash="dotted"),
        Points(
            label="chosen: the softest that meets it",
            x=np.array([spring.rate_N_per_mm]),
            y=np.array([spring.probability]),
        ),
    ]
    least = 0.0 if common.min() < 0.9 else common.min() - 0.01
    return Panel(
        title="Choice of the spring",
        x=label("rate_N_per_mm"),
        y=type(spring).label("probability"),
        marks=marks,
        x_log=True,
        y_limits=(float(min(least, 0.98)), 1.005),
        height=3.2,
    )
