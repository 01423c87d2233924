"""Figures of a design: spring against gear, force against limit, a ring's shape."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hdcal.data.records import Geometry
from hdcal.design.candidate import spreads
from hdcal.design.design_draws import DesignDraws
from hdcal.design.inverse_design import InverseDesign
from hdcal.design.sizes import named
from hdcal.design.wave_generator import WaveGenerator
from hdcal.exported import jit
from hdcal.physics.profile import ring_profile
from hdcal.physics.theory import RING_SERIES
from hdcal.report.canvas import (
    BLUE,
    DARK,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    RED,
    heading,
    note,
    plain,
    style,
    temperature_colours,
)

_profile = jit(ring_profile, static_argnames=("terms",))
_TAILS = (0.025, 0.5, 0.975)
# Points along a curve, and along each side of a map.
_FINE, _COARSE = 41, 21


def generator_figures(found: WaveGenerator) -> dict[str, Figure]:
    """Return the figures of a wave generator by name."""
    ring, at = found.basis.gear.geometry, 0.5 * sum(found.asked.window_mm)
    shape = profile_figure(ring, _modulus(found.basis), at)
    return {"design": generator_figure(found), "profile": shape}


def inverse_figures(found: InverseDesign) -> dict[str, Figure]:
    """Return the figures of an inverse design by name.

    Args:
        found: from `inverse_design`; where no size is free there is no map.
    """
    modulus = _modulus(found.chosen.basis)
    ring = profile_figure(found.drawing, modulus, found.asked.deformation_mm)
    free = {"design": inverse_figure(found)} if found.asked.bounds else {}
    return {**free, "profile": ring}


def _modulus(basis: DesignDraws) -> float:
    return float(np.median(np.asarray(basis.values["E0"])))


def generator_figure(found: WaveGenerator) -> Figure:
    """Draw the balance of spring and gear, and the probability over the spring rate."""
    with style():
        figure = Figure(figsize=(9.4, 4.2), layout="constrained")
        left, right = figure.subplots(1, 2)
        _balance(left, found)
        _probability(right, found)
    return figure


def _balance(axes: Axes, found: WaveGenerator) -> None:
    (low, high), sense = found.asked.sizes_mm, found.asked.sense
    wide = high - low
    along = np.linspace(max(low - 1.5 * wide, 0.02 * low), high + 1.5 * wide, _FINE)
    along = np.sort(sense * along)
    levels = np.asarray(found.asked.temperature_C)
    levels = levels[:: max(len(levels) - 1, 1)]  # the coldest and the warmest
    forces = found.gear.forces(along, levels)
    bands = np.quantile(forces, _TAILS, axis=2)
    for index, colour in enumerate(temperature_colours(levels)):
        lo, middle, hi = bands[:, :, index]
        words = f"gear at {levels[index]:g} °C, 95 %"
        axes.fill_between(along, lo, hi, color=colour, alpha=0.25, linewidth=0)
        axes.plot(along, middle, color=colour, label=words)
    spring = found.chosen
    axes.plot(
        along,
        spring.rate * (sense * spring.interference - along),
        color=DARK,
        linestyle="--",
        label=f"spring of {spring.rate:.4g} N/mm",
    )
    axes.axvspan(
        *found.asked.window_mm, color=GREEN, alpha=0.12, linewidth=0, label="window"
    )
    room = 0.1 * (bands.max() - bands.min())
    axes.set_ylim(bands.min() - room, bands.max() + 4.0 * room)
    axes.set_xlim(along[0], along[-1])
    axes.set_xlabel("radial deformation of the gear [mm]")
    axes.set_ylabel("force on each side [N]")
    axes.legend(loc="upper right")
    heading(axes, "Where spring and gear are in balance")


def _probability(axes: Axes, found: WaveGenerator) -> None:
    rates = [spring.rate for spring in found.springs]
    together = [spring.together for spring in found.springs]
    adjusted = [spring.adjusted for spring in found.springs]
    axes.semilogx(rates, together, color=BLUE, label="one set point for every gear")
    axes.semilogx(
        rates, adjusted, color=ORANGE, linestyle="-.", label="each gear adjusted"
    )
    axes.axhline(found.asked.probability, color=RED, linewidth=0.9, linestyle=":")
    words, at = f"required {found.asked.probability:g}", found.asked.probability
    note(axes, words, (rates[-1], at), (0, -4), ha="right", va="top", color=RED)
    chosen = found.chosen
    axes.plot(chosen.rate, chosen.together, "o", color=DARK, zorder=5)
    axes.set_ylim(min(0.0 if min(together) < 0.9 else min(together) - 0.01, 0.98), None)
    axes.set_xlabel("spring rate [N/mm]")
    axes.set_ylabel("probability inside the window")
    axes.legend(loc="lower right")
    heading(axes, "The softest spring that meets it")


def inverse_figure(found: InverseDesign) -> Figure:
    """Draw the force over the free sizes, the limit, and what was chosen."""
    with style():
        figure = Figure(figsize=(7.6, 4.4), layout="constrained")
        axes = figure.subplots()
        if len(found.asked.bounds) == 1:
            _along_one(axes, found)
        else:
            _over_two(figure, axes, found)
    return figure


def _spreads(found: InverseDesign, sizes: dict) -> np.ndarray:
    """Return both ends, median and the kept force at sizes, with their sign [N]."""
    return found.asked.sense * spreads(found.target, sizes, np.array(_TAILS))


def _along_one(axes: Axes, found: InverseDesign) -> None:
    name, (low, high) = next(iter(found.asked.bounds.items()))
    along = np.linspace(low, high, _FINE)
    table = _spreads(found, {name: along})
    axes.fill_between(along, table[0], table[2], color=BLUE, alpha=0.25, linewidth=0)
    axes.plot(along, table[1], color=BLUE, label="median and 95 % band")
    words = f"not exceeded with probability {found.asked.probability:g}"
    axes.plot(along, table[3], color=PURPLE, linestyle="--", label=words)
    sense = found.asked.sense
    limit, force = sense * found.asked.limit_force_N, sense * found.chosen.force
    axes.axhline(limit, color=RED, linewidth=0.9, label="limit")
    # The limit is kept by this force, not by the median.
    words = f"chosen, {force:.4g} N with that probability"
    axes.plot(found.chosen.sizes[name], force, "o", color=DARK, label=words)
    axes.set_xlabel(f"{named(name)} [mm]")
    axes.set_ylabel("force [N]")
    axes.legend(loc="best")
    heading(axes, _title(found))


def _over_two(figure: Figure, axes: Axes, found: InverseDesign) -> None:
    (first, ends), (second, span) = list(found.asked.bounds.items())[:2]
    x, y = np.linspace(*ends, _COARSE), np.linspace(*span, _COARSE)
    rest = {n: v for n, v in found.chosen.sizes.items() if n not in (first, second)}
    a, b = (grid.ravel() for grid in np.meshgrid(x, y))
    others = {name: np.full(len(a), value) for name, value in rest.items()}
    kept = _spreads(found, {**others, first: a, second: b})[-1]
    table = kept.reshape(len(y), len(x))
    drawn = axes.contourf(x, y, table, 20, cmap="cividis")
    figure.colorbar(
        drawn, ax=axes, label=f"force not exceeded with {found.asked.probability:g} [N]"
    )
    limit = found.asked.sense * found.asked.limit_force_N
    axes.contour(x, y, table, [limit], colors=RED, linewidths=1.6)
    geometry = found.basis.gear.geometry
    own = [float(getattr(geometry, n.removesuffix("_mm"))) for n in (first, second)]
    mark = {"markersize": 8, "markeredgecolor": "white", "linestyle": ""}
    axes.plot(*own, "s", color=GREY, label="tested gear", **mark)
    best = [found.chosen.sizes[n] for n in (first, second)]
    axes.plot(*best, "o", color=DARK, label="chosen", **mark)
    axes.plot([], [], color=RED, label=f"limit {found.asked.limit_force_N:g} N")
    axes.set_xlabel(f"{named(first)} [mm]")
    axes.set_ylabel(f"{named(second)} [mm]")
    axes.legend(loc="upper right", frameon=True, facecolor="white")
    heading(axes, _title(found))


def _title(found: InverseDesign) -> str:
    material = plain(found.chosen.basis.material)
    return f"Force at {found.asked.deformation_mm:g} mm, {material}"


def profile_figure(geometry: Geometry, modulus: float, deformation: float) -> Figure:
    """Draw shape, moment and stress around a ring, and how fast the series gets there.

    Args:
        geometry: sizes [mm].
        modulus: Young's modulus [MPa].
        deformation: radial displacement under each load [mm].
    """
    angle = np.linspace(0.0, np.pi, 181)
    full = _profile(geometry, modulus, deformation, angle)
    few = _profile(geometry, modulus, deformation, angle, terms=3)
    degrees = np.degrees(angle)
    panels = (
        ("Displacement", "[mm]", (("radial w", "radial"), ("along v", "tangential"))),
        ("Bending moment", "[N·mm]", (("M", "moment"),)),
        ("Hoop stress, outer surface", "[MPa]", (("σ", "stress"),)),
    )
    with style():
        figure = Figure(figsize=(9.0, 6.0), layout="constrained")
        axes = figure.subplots(2, 2).ravel()
        for place, (title, unit, curves) in zip(axes[:3], panels, strict=True):
            for (words, field), colour in zip(curves, (BLUE, ORANGE), strict=False):
                place.plot(degrees, getattr(full, field), color=colour, label=words)
                place.plot(
                    degrees, getattr(few, field), ":", color=colour, linewidth=1.2
                )
            place.plot([], [], ":", color=GREY, label="first 3 terms")
            place.set_xticks([0, 45, 90, 135, 180])
            place.set_xlabel("angle from a load [°]")
            place.set_ylabel(unit)
            place.legend(loc="best")
            heading(place, title)
        _truncation(axes[3])
    return figure


def _truncation(axes: Axes) -> None:
    n = 2.0 * np.arange(1, 201)
    counts = np.array([1, 2, 3, 5, 10, 20, 50, 100, 200])
    for part, whole, colour, words in (
        (1.0 / (n**2 - 1.0) ** 2, RING_SERIES, BLUE, "displacement"),
        (1.0 / (n**2 - 1.0), 0.5, ORANGE, "moment and stress"),
    ):
        missing = 1.0 - np.cumsum(part)[counts - 1] / whole
        axes.loglog(counts, missing, "o-", color=colour, markersize=4, label=words)
    axes.set_xlabel("terms of the series")
    axes.set_ylabel("missing under the load, relative")
    axes.legend(loc="best")
    heading(axes, "What a truncated series misses")
