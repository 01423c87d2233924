"""An elastic wave generator: the spring that holds a gear inside a window."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Gear
from hdcal.data.plausible import implausible
from hdcal.design.answer import WindowAsked
from hdcal.design.checks import place_findings, probability_findings
from hdcal.design.design_draws import DesignDraws, design_draws
from hdcal.design.next_gear import NextGear, next_gear
from hdcal.design.sentences import beyond_tested
from hdcal.design.sizes import with_reference
from hdcal.design.springs import Spring, judge_all, set_points, softest
from hdcal.errors import Finding, Findings, InputError
from hdcal.notebook import Shown
from hdcal.prediction.engine.models import Models

# Default range of the spring rate, relative to the gear's own stiffness.
RATE_RANGE = (0.01, 100.0)
# A spring stands inside the gear and works over part of its own length: its free end
# stands no farther from the undeformed gear than this share of the radius.
MOST_TRAVEL = 0.25
# Points of the window at which the force has to grow with deformation.
_ALONG = 9


@dataclass(frozen=True, repr=False)
class WaveGenerator(Shown):
    """The elastic wave generator that meets a window, and how it was judged.

    Springs, forces and set points are along the sense of loading.

    Attributes:
        basis: what the draws belong to.
        gear: whom the window is for.
        asked: window, temperatures and probability.
        springs: every rate that was looked at, softest first.
        chosen: the softest that meets the requirement.
        forces: F at the least deformation, in the middle and at the largest, at each
            temperature [N]: [3, T, draw].
        error: of each draw's set point as built [mm], shape (draw,).
        warnings: what is extrapolated, in words.
    """

    basis: DesignDraws
    gear: NextGear
    asked: WindowAsked
    springs: tuple[Spring, ...]
    chosen: Spring
    forces: np.ndarray
    error: np.ndarray
    warnings: tuple[str, ...]

    def intervals(self, level: int | None = None) -> np.ndarray:
        """Return where x holds each gear in the window [mm], shape (2, draw).

        Args:
            level: of the temperatures; by default at all of them.
        """
        forces = self.forces if level is None else self.forces[:, level : level + 1]
        return set_points(self.chosen.rate, self.asked.sizes_mm, forces)


def wave_generator(
    source: Models | Gear,
    window: tuple[float, float],
    *,
    temperatures: Sequence[float] | None = None,
    probability: float = 0.99,
    tolerances: Mapping[str, float] | None = None,
    setting_sd: float = 0.0,
    rates: tuple[float, float] | None = None,
    seed: int = 0,
) -> WaveGenerator:
    """Find the softest spring with one set point that keeps gears in a window.

    Args:
        source: a calibration; or a gear, for what its priors say.
        window: lowest and highest deformation, radial, of the gear [mm]. In the one
            nearer to zero teeth begin to have backlash, in the other they jam. A
            generator that pulls has both below zero.
        temperatures: at all of which a gear has to stay inside [°C]; by default the
            reference one.
        probability: with which the next gear has to stay inside.
        tolerances: ± of sizes [mm] by name, see `next_gear`.
        setting_sd: sd of the set point as built [mm].
        rates: spring rates to look at [N/mm]; by default 0.01 to 100 times the
            stiffness of the gear, without those too soft to stand inside it.
        seed: of scatter and setting.

    Returns:
        The generator. Probabilities are averages over the draws.

    Raises:
        NotUsable: the calibration failed its checks.
        InputError: bad input, or no spring rate meets the requirement, or the softest
            that does is too soft to stand inside the gear.
    """
    draws = design_draws(source, seed=seed)
    levels = tuple(with_reference(draws, temperatures).tolist())
    given = levels, probability, setting_sd, dict(tolerances or {})
    asked = WindowAsked(window, *given)
    with Findings() as wrong:
        wrong += _findings(draws, asked, rates)
        gear = wrong.attempt(next_gear, draws, asked.tolerances_mm, seed)
    assert gear is not None
    return _generator(draws, gear, asked, rates, seed)


def _generator(
    draws: DesignDraws,
    gear: NextGear,
    asked: WindowAsked,
    rates: tuple[float, float] | None,
    seed: int,
) -> WaveGenerator:
    window, levels = asked.sizes_mm, np.asarray(asked.temperature_C)
    along = np.linspace(*window, _ALONG)
    forces = asked.sense * gear.forces(asked.sense * along, levels)
    _check_growing(forces)
    radius = float(draws.gear.geometry.radius)
    least = float(np.max(forces[-1])) / max(MOST_TRAVEL * radius - window[1], window[1])
    if rates is None:
        middle = np.median(forces[_ALONG // 2]) / along[_ALONG // 2]
        low, high = (share * middle for share in RATE_RANGE)
        rates = max(low, least), high
    scatter = np.random.default_rng([seed, 1]).normal(size=draws.size)
    error = asked.setting_sd_mm * scatter
    springs = judge_all(rates, window, forces, error)
    chosen = softest(springs, window, forces, error, asked.probability)
    if chosen is None:
        raise InputError([_unmet(springs, asked)])
    if chosen.interference > MOST_TRAVEL * radius and chosen.rate < least:
        raise InputError([_too_soft(chosen, asked, radius, least)])
    return WaveGenerator(
        draws,
        gear,
        asked,
        tuple(sorted({*springs, chosen}, key=lambda spring: spring.rate)),
        chosen,
        forces[[0, _ALONG // 2, -1]],
        error,
        (*beyond_tested(draws, np.array(asked.window_mm), levels), *draws.misfits),
    )


def _unmet(springs: list[Spring], asked: WindowAsked) -> Finding:
    window, required = asked.window_mm, asked.probability
    best = max(springs, key=lambda spring: spring.together)
    words = (
        f"no spring rate between {springs[0].rate:.4g} and {springs[-1].rate:.4g} N/mm "
        f"meets {window[0]:g} … {window[1]:g} mm with probability {required:g}: the "
        f"best is {best.rate:.4g} N/mm with {best.together:.4g}"
    )
    alone = max(springs, key=lambda spring: spring.adjusted)
    remedy = "Widen the window, narrow the temperatures or build the set point closer"
    if alone.adjusted >= required:
        each = f"{alone.rate:.4g} N/mm reaches {alone.adjusted:.4g}"
        remedy += f"; adjusted gear by gear, {each}"
    return Finding("window", words, remedy)


def _too_soft(
    spring: Spring, asked: WindowAsked, radius: float, least: float
) -> Finding:
    words = (
        f"the softest spring that does it has {spring.rate:.4g} N/mm and would stand "
        f"{asked.sense * spring.interference:.4g} mm from the undeformed gear, more "
        f"than {MOST_TRAVEL:g} of its radius of {radius:g} mm"
    )
    return Finding("rates", words, f"Look at {least:.4g} N/mm and stiffer")


def _check_growing(forces: np.ndarray) -> None:
    share = float(np.mean(np.all(np.diff(forces, axis=0) > 0.0, axis=(0, 1))))
    if share < 1.0:
        words = (
            f"in {1.0 - share:.2g} of the draws the force does not grow with "
            "deformation inside the window, so that a spring may snap through"
        )
        remedy = "Name a window inside what was tested, or calibrate without the effect"
        raise InputError([Finding("window", words, remedy)])


def _findings(draws: DesignDraws, asked: WindowAsked, rates) -> list[Finding]:
    findings, setting_sd = [], asked.setting_sd_mm
    low, high = asked.window_mm
    if not low < high:
        words = f"{low:g}:{high:g} is empty"
        findings.append(Finding("window", words, "Write LO:HI, e.g. 0.38:0.42"))
    elif low < 0.0 < high:
        words = f"{low:g}:{high:g} holds zero, where no spring presses nor pulls"
        remedy = "Give both ends one sign, e.g. 0.38:0.42"
        findings.append(Finding("window", words, remedy))
    findings += probability_findings(draws, asked.probability)
    findings += implausible("setting_sd", setting_sd) + implausible("rates", rates)
    if rates is not None and not rates[0] < rates[1]:
        words = f"{rates[0]:g}:{rates[1]:g} is no range of spring rates"
        findings.append(Finding("rates", words, "Write LO:HI in N/mm"))
    radius = float(draws.gear.geometry.radius)
    place = np.asarray(asked.window_mm, float), np.asarray(asked.temperature_C)
    names = "window", "temperatures"
    return findings + place_findings(draws, *place, radius, names)
