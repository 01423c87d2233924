"""An elastic wave generator: the softest spring that keeps a gear inside a window."""

from collections.abc import Mapping, Sequence

import numpy as np

from hdcal.data.case import Gear
from hdcal.design.design_draws import DesignDraws, design_draws
from hdcal.design.extrapolation import extrapolations
from hdcal.design.next_gear import NextGear, next_gear
from hdcal.design.sizes import with_reference
from hdcal.design.wave_generator.generator_result import WaveGenerator
from hdcal.design.wave_generator.springs import Spring, judge_all, softest
from hdcal.design.wave_generator.window import WindowAsked, window_findings
from hdcal.errors import Finding, Findings, InputError
from hdcal.prediction.engine.models import Models

# Default range of the spring rate, relative to the stiffness of the gear.
RATE_RANGE = (0.01, 100.0)
# A spring stands inside the gear and works over part of its length: its free end stands
# no farther from the undeformed gear than this share of the radius.
MOST_TRAVEL = 0.25
# Points of the window at which the force has to grow with deformation.
_ALONG = 9


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
        source: a calibration; or a gear, to use its priors.
        window: lowest and highest deformation, radial, of the gear [mm]. At the end
            nearer to zero the teeth begin to have backlash, at the other one they jam.
            A generator that pulls has both below zero.
        temperatures: at all of which a gear has to stay inside [°C]; by default the
            reference temperature.
        probability: with which the next gear has to stay inside.
        tolerances: ± of sizes [mm] by name, see `next_gear`.
        setting_sd: sd of the set point as built [mm].
        rates: spring rates to consider [N/mm]; by default 0.01 to 100 times the
            stiffness of the gear, except those too soft to stand inside it.
        seed: of scatter and setting.

    Returns:
        The generator. Probabilities are averages over the draws.

    Raises:
        NotUsable: the calibration failed its checks.
        InputError: invalid input, or no spring rate meets the requirement, or the
            softest one that does is too soft to stand inside the gear.
    """
    draws = design_draws(source, seed=seed)
    asked = WindowAsked(
        window_mm=window,
        temperature_C=with_reference(draws, temperatures).tolist(),
        probability=probability,
        setting_sd_mm=setting_sd,
        tolerances_mm=dict(tolerances or {}),
    )
    with Findings() as wrong:
        wrong += window_findings(draws, asked, rates)
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
        source=draws,
        materials=(draws.material,),
        extrapolations=tuple(extrapolations(draws, np.array(asked.window_mm), levels)),
        interval_kind=gear.interval_kind(draws),
        asked=asked,
        next_gear=gear,
        springs=_with(springs, chosen),
        chosen=chosen,
        forces=forces[[0, _ALONG // 2, -1]],
        error=error,
    )


def _with(springs: Sequence[Spring], chosen: Spring) -> tuple[Spring, ...]:
    """Return springs with the chosen one among them, softest first."""
    every = springs if chosen in springs else [*springs, chosen]
    return tuple(sorted(every, key=lambda spring: spring.rate))


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
        f"the free end of the softest suitable spring, {spring.rate:.4g} N/mm, is "
        f"{asked.sense * spring.interference:.4g} mm from the undeformed gear, more "
        f"than {MOST_TRAVEL:g} of its radius of {radius:g} mm"
    )
    return Finding("rates", words, f"Consider only {least:.4g} N/mm and stiffer")


def _check_growing(forces: np.ndarray) -> None:
    share = float(np.mean(np.all(np.diff(forces, axis=0) > 0.0, axis=(0, 1))))
    if share < 1.0:
        words = (
            f"in {1.0 - share:.2g} of the draws the force does not grow with "
            "deformation inside the window, so that a spring may snap through"
        )
        remedy = (
            "Give a window inside the tested range, or calibrate without the effect"
        )
        raise InputError([Finding("window", words, remedy)])
