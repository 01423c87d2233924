"""An elastic wave generator: the softest spring that keeps a gear inside a window."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, ValidationInfo, field_validator

from hdcal.data.gear_file.validation import fault, requested, within
from hdcal.design.charts import balance_chart
from hdcal.design.gears import calibrated_gears
from hdcal.design.request import Asked, Window, check_sizes, gears_of
from hdcal.design.result import DesignResult, Ends, Stress, shared_fields
from hdcal.design.springs import Kept, Spring, SpringGap, judge_all, kept_at
from hdcal.errors import Finding, InputError
from hdcal.prediction.models import Models
from hdcal.report.charts.chart_spec import Chart
from hdcal.report.item import Interval, quantity

# Range of the spring rate, relative to the stiffness of the gear.
RATE_RANGE = (0.01, 100.0)
# A spring stands inside the gear and works over part of its length: its free end
# stands no farther from the undeformed gear than this share of the radius.
MOST_TRAVEL = 0.25
# Points of the window at which the force has to grow with deformation.
_ALONG = 9


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
            raise fault(words, "Give both ends one sign, e.g. 0.38:0.42")
        check_sizes(gears_of(info), {}, window)
        return window

    @property
    def sense(self) -> int:
        """Sense of loading: +1 where the gear is pressed, −1 where it is pulled."""
        return -1 if self.window_mm[0] < 0.0 else 1


class KeptAt(Kept):
    """Forces and probabilities with the chosen spring, at one temperature."""

    temperature_C: float = quantity("temperature", "°C")
    at_lo: Interval = quantity("force at the lower end", "N")
    at_middle: Interval = quantity("force in the middle", "N")
    at_hi: Interval = quantity("force at the upper end", "N")


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
    at_temperature: tuple[KeptAt, ...]
    stress: Stress

    @property
    def at_reference(self) -> KeptAt:
        """Forces and probabilities at the temperature nearest to the reference."""
        reference = self.source.gear.reference_temperature
        return min(self.at_temperature, key=lambda o: abs(o.temperature_C - reference))

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
        window: lowest and highest deformation, radial, of the gear [mm]. At the end
            nearer to zero the teeth begin to have backlash, at the other one they jam.
            A generator that pulls has both below zero.
        temperatures: at all of which a gear has to stay inside [°C]; by default the
            reference temperature.
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
    rates = _usual_rates(gap, middle, radius)
    springs, chosen = judge_all(rates, gap, asked.probability)
    if chosen is None:
        raise InputError([_unmet(springs, asked.probability)])

    def mirrored(one: Spring) -> Spring:
        place = {"interference_mm": asked.sense * one.interference_mm}
        return one.model_copy(update=place)

    return WaveGenerator(
        **shared_fields(gears, asked.window_mm, levels, {}),
        asked=asked,
        spring=mirrored(chosen),
        springs=tuple(map(mirrored, springs)),
        at_temperature=_kept(chosen, gap, middle, asked),
        stress=Stress.of(gears, gears.stresses({}, high, levels)),
    )


def _usual_rates(gap: SpringGap, middle: np.ndarray, radius: float) -> Ends:
    stiffness = float(np.median(middle)) / (0.5 * (gap.low + gap.high))
    room = max(MOST_TRAVEL * radius - gap.high, gap.high)
    least = float(np.max(gap.force_high)) / room
    return max(RATE_RANGE[0] * stiffness, least), RATE_RANGE[1] * stiffness


def _kept(
    spring: Spring, gap: SpringGap, middle: np.ndarray, asked: WindowAsked
) -> tuple[KeptAt, ...]:
    found = []
    for row, warm in enumerate(asked.temperature_C):
        ends = np.stack([gap.force_low[row], middle[row], gap.force_high[row]])
        lo, half, hi = map(Interval.of, (asked.sense * ends)[:: asked.sense])
        here = gap._replace(force_low=ends[:1], force_high=ends[2:])
        kept: dict = kept_at(spring.rate_N_per_mm, spring.interference_mm, here)
        kept |= {"temperature_C": warm, "at_lo": lo, "at_middle": half, "at_hi": hi}
        found.append(KeptAt(**kept))
    return tuple(found)


def _require_growing(forces: np.ndarray) -> None:
    share = float(np.mean(np.all(np.diff(forces, axis=0) > 0.0, axis=(0, 1))))
    if share < 1.0:
        words = f"in {1.0 - share:.2g} of the draws the force does not grow with "
        words += "deformation inside the window, so that a spring may snap through"
        remedy = "Give a window in the tested range, or calibrate without the effect"
        raise InputError([Finding("window", words, remedy)])


def _unmet(springs: Sequence[Spring], required: float) -> Finding:
    best, (soft, *_, stiff) = max(springs, key=lambda one: one.probability), springs
    words = f"no spring rate between {soft.rate_N_per_mm:.4g} and "
    words += f"{stiff.rate_N_per_mm:.4g} N/mm keeps it with probability {required:g}: "
    words += f"the best is {best.rate_N_per_mm:.4g} N/mm with {best.probability:.4g}"
    remedy = "Widen the window, narrow the temperatures or build the set point closer"
    return Finding("window", words, remedy)
