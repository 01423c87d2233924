"""Charts of designs and studies."""

from typing import TYPE_CHECKING

import numpy as np

from hdcal.report.charts import chart_spec as spec

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


def limit_chart(found: "InverseDesign") -> spec.Chart:
    """Return the force over each free size, the others as chosen."""
    asked, chosen, sense = found.asked, found.design, found.asked.sense
    panels, limit = [], sense * asked.limit_force_N
    for name, bounds in asked.bounds.items():
        x = np.linspace(*bounds, _FINE)
        forces = [found.target.forces(chosen.sizes | {name: size}) for size in x]
        ends = sense * np.quantile(forces, _TAILS, axis=1)
        kept = sense * np.array([found.target.kept(each) for each in forces])
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


def balance_chart(found: "WaveGenerator") -> spec.Chart:
    """Return spring against gear, and the probability over the spring rate."""
    asked, spring, sense = found.asked, found.spring, found.asked.sense
    low, high = asked.window_mm
    x = np.linspace(low - 1.5 * (high - low), high + 1.5 * (high - low), _FINE)
    x, gears = x[sense * x > 0.0], found.source
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
    name = f"spring of {spring.rate_N_per_mm:.4g} N/mm"
    marks.append(spec.Line(label=name, x=x, y=force, colour=spec.INK, dash="dashed"))
    balance = spec.Panel(
        title="Balance of spring and gear",
        x="radial deformation of the gear [mm]",
        y="force on each side [N]",
        marks=marks,
        y_limits=(float(np.min(bands)), float(np.max(bands))),
        height=3.6,
    )
    rates, shares = np.transpose(
        [(one.rate_N_per_mm, one.probability) for one in found.springs]
    )
    place = np.array([spring.rate_N_per_mm]), np.array([spring.probability])
    least = f"required {asked.probability:g}"
    choice = spec.Panel(
        title="Choice of the spring",
        x="spring rate [N/mm]",
        y="probability inside the window",
        marks=[
            spec.Line(x=rates, y=shares),
            spec.Rule(
                at=asked.probability, label=least, colour=spec.RED, dash="dotted"
            ),
            spec.Points(label="chosen", x=place[0], y=place[1]),
        ],
        x_log=True,
        height=3.2,
    )
    return spec.Chart(panels=[balance, choice])


def study_chart(found: "Study") -> spec.Chart:
    """Return the median force with its interval over what was varied first.

    There is a curve for each combination of what else was varied; of more than six only
    some.
    """
    columns = {name: np.array(each) for name, each in found.designs.items()}
    forces = np.stack([columns[f"force_{end}_N"] for end in ("lo", "median", "hi")])
    kind = found.interval_kind.removeprefix("equal-tailed ")
    title, y = f"Median and {100.0 * found.interval:g} % {kind}", "force [N]"
    along = found.varied[0] if found.varied else "deformation_mm"
    others, marks = [name for name in found.varied if name != along], []
    labels = [title] * len(columns[along])
    if others:
        texts = ([f"{name} {value}" for value in columns[name]] for name in others)
        labels = [", ".join(row).replace("_", " ") for row in zip(*texts, strict=True)]
    each = list(dict.fromkeys(labels))
    kept = (
        np.linspace(0, len(each) - 1, min(len(each), len(spec.CYCLE)))
        .round()
        .astype(int)
    )
    for place, colour in zip(kept, spec.CYCLE, strict=False):
        rows = np.flatnonzero(np.array(labels) == each[place])
        rows = rows[np.argsort(columns[along][rows], kind="stable")]
        marks += _band(each[place], columns[along][rows], forces[:, rows], colour)
    panel = spec.Panel(title=title, x=_axis(along), y=y, marks=marks)
    return spec.Chart(panels=[panel])
