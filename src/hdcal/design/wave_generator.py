"""An elastic wave generator: the softest spring that keeps a gear inside a window.

A spring of rate c presses on the gear from inside at each of two opposed places. Its
free end stands at x beyond the undeformed gear, so that in balance

    c (x − ω) = F(ω, T),

with force F and radial deformation ω of one side. F grows with ω; so does ω + F(ω)/c,
and ω ≥ lo exactly if x ≥ lo + F(lo)/c, ω ≤ hi exactly if x ≤ hi + F(hi)/c. A gear is
inside the window at all temperatures exactly if x lies in one interval, so that
every probability here is a count of intervals: no equation has to be solved.
"""

from collections.abc import Mapping, Sequence
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field, ValidationInfo, field_validator

from hdcal.data.gear_file.validation import fault, requested, within
from hdcal.design.charts import balance_chart
from hdcal.design.gears import calibrated_gears
from hdcal.design.request import Asked, Window, check_sizes, gears_of
from hdcal.design.result import DesignResult, Ends, Stress, shared_fields
from hdcal.errors import Finding, InputError
from hdcal.prediction.models import Models
from hdcal.report.charts.chart_spec import Chart
from hdcal.report.item import Interval, Item, Probability, quantity
from hdcal.report.words import digits

# Range of the spring rate, relative to the stiffness of the gear.
RATE_RANGE = (0.01, 100.0)
# A spring stands inside the gear and works over part of its length: its free end
# stands no farther from the undeformed gear than this share of the radius.
MOST_TRAVEL = 0.25
# Points of the window at which the force has to grow with deformation.
_ALONG = 9
# Number of rates, evenly spaced in their logarithm, and of bisections between two of
# them: the rate is then known to 1 %.
_RATES, _HALVINGS = 61, 4


class WindowAsked(Asked):
    """The request for a wave generator; both ends of the window have one sign."""

    window_mm: Window = Field(validation_alias="window")
    setting_sd_mm: Annotated[float, within("setting_sd")] = Field(
        validation_alias="setting_sd"
    )

    @field_validator("window_mm")
    @classmethod
    def _check_window(cls, window: Ends, info: ValidationInfo) -> Ends:
        if window[0] <= 0.0 <= window[1]:
            words = f"{window[0]:g}:{window[1]:g} contains zero"
            raise fault(words, "Give both ends the same sign, such as 0.38:0.42")
        check_sizes(gears_of(info), {}, window)
        return window

    @property
    def sense(self) -> int:
        """Sense of loading: +1 where the gear is pressed, −1 where it is pulled."""
        return -1 if self.window_mm[0] < 0.0 else 1


class SpringGap(NamedTuple):
    """A window [mm] and the gears that have to stay inside.

    Forces at its ends [N] are (temperature, draw); the error is that by which x comes
    out too large [mm], (draw,); `least` is the probability of what no draw shows.
    """

    low: float
    high: float
    force_low: np.ndarray
    force_high: np.ndarray
    error: np.ndarray
    least: float = 0.0


class Spring(Item):
    """A spring rate c with its best set point x, one for every gear."""

    probability: Probability = quantity("probability inside the window")
    zero_backlash: Probability = quantity("probability of no backlash")
    no_jam: Probability = quantity("probability of no jam")
    rate_N_per_mm: float = quantity("spring rate", "N/mm")
    interference_mm: float = quantity("set point", "mm")


class WaveGenerator(DesignResult):
    """The softest spring that keeps a window, among all rates that were considered.

    The stress is that at the largest deformation.
    """

    template = "design/wave_generator.md.j2"
    table = "springs"

    format: Literal["hdcal.design/1"] = "hdcal.design/1"
    kind: Literal["wave_generator"] = "wave_generator"
    asked: WindowAsked
    spring: Spring
    springs: tuple[Spring, ...]
    force_N: tuple[Interval, ...] = quantity("force in the middle", "N")
    stress: Stress

    def make_charts(self) -> Mapping[str, Chart]:
        """Return spring against gear, and the choice of the spring."""
        return {"design": balance_chart(self)}


def wave_generator(
    models: Models,
    window: tuple[float, float],
    *,
    temperatures: Sequence[float] | None = None,
    probability: float = 0.99,
    tolerances: Mapping[str, float] | None = None,
    setting_sd: float = 0.0,
    seed: int = 0,
) -> WaveGenerator:
    """Find the softest spring with one set point that keeps gears in a window.

    Args:
        models: from `calibrate` or `diagnose`.
        window: lowest and highest radial deformation of the gear [mm]: backlash begins
            at the end nearer to zero, jamming at the other; below zero it is pulled.
        temperatures: of all requirements [°C]; by default the reference.
        probability: with which the next gear has to stay inside.
        tolerances: ± of sizes [mm] by name; sizes are uniform within them.
        setting_sd: sd of the set point as built [mm].
        seed: of scatter and setting.

    Raises:
        NotUsable: the calibration failed its checks.
        InputError: invalid input, or no spring of 0.01 to 100 times the stiffness of
            the gear meets the requirement.
    """
    tested = calibrated_gears(models, seed)
    asked = requested(
        WindowAsked,
        tested,
        window=window,
        temperatures=temperatures,
        probability=probability,
        tolerances=dict(tolerances or {}),
        setting_sd=setting_sd,
    )
    gears = tested.next_ones(asked.tolerances_mm, seed, asked.sense)
    low, high = sorted(map(abs, asked.window_mm))
    levels, along = asked.temperature_C, np.linspace(low, high, _ALONG)
    place = np.repeat(along, len(levels)), np.tile(levels, _ALONG)
    forces = gears.forces(*place, gears.factor({})).reshape(_ALONG, len(levels), -1)
    _require_growing(forces)
    error = np.random.default_rng([seed, 1]).normal(size=gears.model.size)
    error, least = asked.setting_sd_mm * error, 0.5 / gears.independent
    gap = SpringGap(low, high, forces[0], forces[-1], error, least)
    middle, radius = forces[_ALONG // 2], float(gears.gear.geometry.radius)
    stiffness = float(np.median(middle)) / (0.5 * (low + high))
    softest = float(np.max(forces[-1])) / max(MOST_TRAVEL * radius - high, high)
    rates = max(RATE_RANGE[0] * stiffness, softest), RATE_RANGE[1] * stiffness
    springs, chosen = judge_all(rates, gap, asked.probability)
    if chosen is None:
        raise InputError([_unmet(springs, asked.probability)])

    def mirrored(spring: Spring) -> Spring:
        place = {"interference_mm": asked.sense * spring.interference_mm}
        return spring.model_copy(update=place)

    return WaveGenerator(
        **shared_fields(gears, asked.window_mm, levels, {}),
        asked=asked,
        spring=mirrored(chosen),
        springs=tuple(map(mirrored, springs)),
        force_N=tuple(Interval.of(asked.sense * force) for force in middle),
        stress=Stress.of(gears, gears.stresses({}, high, levels)),
    )


def set_points(rate: float, gap: SpringGap) -> np.ndarray:
    """Return the ends of the x at which each gear stays inside [mm], (2, draw).

    There is none where the first end is larger.
    """
    low = gap.low + np.max(gap.force_low, axis=0) / rate
    high = gap.high + np.min(gap.force_high, axis=0) / rate
    return np.stack([low, high]) - gap.error


def best_common(low: np.ndarray, high: np.ndarray) -> float:
    """Return the point that lies in most of the intervals [low, high].

    If several stretches are equally good, it is the middle of the longest one.
    """
    full = low <= high
    starts, ends = np.sort(low[full]), np.sort(high[full])
    if not len(starts):
        return float(np.mean(0.5 * (low + high)))
    # Between two neighbouring ends the count is constant; starts come first in ties.
    edges = np.concatenate([starts, ends])
    change = np.concatenate([np.ones(len(starts)), -np.ones(len(ends))])
    order = np.lexsort((-change, edges))
    edges, count = edges[order], np.cumsum(change[order])
    most = np.flatnonzero(count[:-1] == count.max())
    widest = most[np.argmax(edges[most + 1] - edges[most])]
    return float(0.5 * (edges[widest] + edges[widest + 1]))


def judge(rate: float, gap: SpringGap) -> Spring:
    """Return the best common set point at a rate [N/mm]."""
    low, high = set_points(rate, gap)
    x = best_common(low, high)
    above, below = x >= low, x <= high
    kept = {"probability": above & below, "zero_backlash": above, "no_jam": below}
    ends = gap.least, 1.0 - gap.least
    shares = {name: float(np.clip(gears.mean(), *ends)) for name, gears in kept.items()}
    return Spring(rate_N_per_mm=rate, interference_mm=x, **shares)


def judge_all(
    rates: tuple[float, float], gap: SpringGap, required: float
) -> tuple[list[Spring], Spring | None]:
    """Return springs between two rates [N/mm], and the softest suitable one or None."""
    springs = [judge(float(rate), gap) for rate in np.geomspace(*rates, _RATES)]
    met = [row for row, each in enumerate(springs) if each.probability >= required]
    if not met:
        return springs, None
    chosen, below = springs[met[0]], springs[max(met[0] - 1, 0)].rate_N_per_mm
    for _ in range(_HALVINGS if met[0] else 0):
        middle = judge(float(np.sqrt(below * chosen.rate_N_per_mm)), gap)
        springs.append(middle)
        if middle.probability >= required:
            chosen = middle
        else:
            below = middle.rate_N_per_mm
    return sorted(springs, key=lambda spring: spring.rate_N_per_mm), chosen


def _require_growing(forces: np.ndarray) -> None:
    share = float(np.mean(np.all(np.diff(forces, axis=0) > 0.0, axis=(0, 1))))
    if share < 1.0:
        words = f"in {1.0 - share:.2g} of the draws the force does not grow with "
        words += "deformation inside the window, so that the gear may snap through"
        remedy = "Give a window in the tested range, or calibrate without the effect"
        raise InputError([Finding("window", words, remedy)])


def _unmet(springs: Sequence[Spring], required: float) -> Finding:
    best, (soft, *_, stiff) = max(springs, key=lambda each: each.probability), springs
    low, high, at = (digits(each.rate_N_per_mm, 4) for each in (soft, stiff, best))
    words = (
        f"no spring rate between {low} and {high} N/mm keeps the window with "
        "probability "
    )
    words += f"{required:g}: the best is {at} N/mm with {best.probability:.4g}"
    remedy = (
        "Widen the window, or reduce the temperature range or the set-point scatter"
    )
    return Finding("window", words, remedy)
