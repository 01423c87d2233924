"""Charts of designs and studies."""

from typing import TYPE_CHECKING

import numpy as np

from hdcal.report.charts import chart_spec as spec
from hdcal.report.words import digits

if TYPE_CHECKING:
    from hdcal.design.inverse_design import InverseDesign
    from hdcal.design.study import Study
    from hdcal.design.wave_generator import WaveGenerator

_TAILS = (0.025, 0.5, 0.975)
# Points along a curve.
_FINE = 41


def _axis(name: str) -> str:
    words, _, unit = name.rpartition("_")
    return f"{words.replace('_', ' ')} [{'°C' if unit == 'C' else unit}]"


def _band(name: str, x, ends, colour: str) -> list[spec.Mark]:
    low, middle, high = np.sort(ends, axis=0)
    band = spec.Band(label=name, x=x, low=low, high=high, colour=colour)
    return [band, spec.Line(label=name, x=x, y=middle, colour=colour)]


def limit_chart(result: "InverseDesign") -> spec.Chart:
    """Return the force over each free size, the others as chosen."""
    asked, chosen, sense = result.asked, result.design, result.asked.sense
    panels, limit = [], sense * asked.limit_force_N
    for name, bounds in asked.bounds.items():
        x = np.linspace(*bounds, _FINE)
        forces = [result.target.forces(chosen.sizes | {name: size}) for size in x]
        ends = sense * np.quantile(forces, _TAILS, axis=1)
        kept = sense * np.array([result.target.kept(force) for force in forces])
        share = f"not exceeded with probability {asked.probability:g}"
        size, force = np.array([chosen.sizes[name]]), np.array([chosen.force_kept_N])
        marks = [
            *_band("median and 95 %", x, ends, spec.BLUE),
            spec.Line(label=share, x=x, y=kept, colour=spec.PURPLE, dash="dashed"),
            spec.Rule(label=f"limit {limit:g} N", at=limit, colour=spec.RED),
            spec.Points(label="chosen", x=size, y=force),
        ]
        panels.append(spec.Panel(x=_axis(name), y="force [N]", marks=marks, height=3.0))
    return spec.Chart(panels=panels)


def balance_chart(result: "WaveGenerator") -> spec.Chart:
    """Return the force of spring and gear over the deformation."""
    asked, spring, sense = result.asked, result.spring, result.asked.sense
    low, high = asked.window_mm
    x = np.linspace(low - 1.5 * (high - low), high + 1.5 * (high - low), _FINE)
    x, gears = x[sense * x > 0.0], result.source
    factor = gears.factor({})
    marks: list[spec.Mark] = [
        spec.Span(low=low, high=high, axis="x", label="window", colour=spec.GREEN)
    ]
    # The coldest and the warmest temperature.
    levels, bands = {asked.temperature_C[0], asked.temperature_C[-1]}, []
    for level, colour in zip(sorted(levels), (spec.BLUE, spec.ORANGE), strict=False):
        forces = gears.forces(sense * x, np.full(len(x), level), factor)
        bands.append(sense * np.quantile(forces, _TAILS, axis=1))
        marks += _band(f"gear at {level:g} °C, 95 %", x, bands[-1], colour)
    force = spring.rate_N_per_mm * (spring.interference_mm - x)
    name = f"spring of {digits(spring.rate_N_per_mm, 4)} N/mm"
    marks.append(spec.Line(label=name, x=x, y=force, colour=spec.INK, dash="dashed"))
    panel = spec.Panel(
        title="Balance of spring and gear",
        x="radial deformation of the gear [mm]",
        y="force on each side [N]",
        marks=marks,
        y_limits=(float(np.min(bands)), float(np.max(bands))),
    )
    return spec.Chart(panels=[panel])


def study_chart(study: "Study") -> spec.Chart:
    """Return the median force with its interval over what was varied first.

    There is a curve for each combination of what else was varied; of more than six only
    some.
    """
    kind = study.interval_kind.removeprefix("equal-tailed ")
    title = f"Median and {100.0 * study.interval:g} % {kind}"
    along, *others = study.varied or ("deformation_mm",)
    curves = [(title, study.designs)]
    if others:
        curves = [
            (", ".join(f"{name} {rows[name].iloc[0]}" for name in others), rows)
            for _, rows in study.designs.groupby(others, sort=False)
        ]
    marks, most = [], len(spec.CYCLE)
    kept = np.linspace(0, len(curves) - 1, min(len(curves), most)).round().astype(int)
    for place, colour in zip(kept, spec.CYCLE, strict=False):
        label, rows = curves[place][0].replace("_", " "), curves[place][1]
        rows = rows.sort_values(along, kind="stable")
        ends = rows[["force_lo_N", "force_median_N", "force_hi_N"]].to_numpy().T
        marks += _band(label, rows[along].to_numpy(), ends, colour)
    panel = spec.Panel(title=title, x=_axis(along), y="force [N]", marks=marks)
    return spec.Chart(panels=[panel])
