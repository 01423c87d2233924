"""Designs as answers, and all that their result folders hold."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from hdcal.design.answer import (
    CandidateAnswer,
    CandidateForce,
    ChosenSpring,
    DesignAnswer,
    GearByGear,
    GeneratorAnswer,
    InverseAnswer,
    SetPoint,
    SpringCurve,
    StressAtWindow,
    WindowForces,
    WindowKept,
)
from hdcal.design.assumptions import assumptions
from hdcal.design.candidate import Candidate
from hdcal.design.design_draws import DesignDraws
from hdcal.design.document import generator_document, inverse_document
from hdcal.design.inverse_design import InverseDesign
from hdcal.design.sentences import (
    generator_headline,
    generator_words,
    inverse_headline,
    inverse_words,
    next_step,
)
from hdcal.design.wave_generator import WaveGenerator
from hdcal.physics.profile import peak_stress
from hdcal.prediction.engine.loading_sense import LoadingSense, ends_along
from hdcal.report.parameters import INTERVAL, credible_interval
from hdcal.report.posterior_answer import CalibratedGear
from hdcal.report.write import Report

D = TypeVar("D", bound=DesignAnswer)
_FILE = "design.json"


def origin(basis: DesignDraws, interval: float, interval_kind: str) -> dict[str, Any]:
    """Return what every design answer says of the draws it rests on."""
    return {
        "reasons": (),
        # In words once the numbers are there, see `in_words`.
        "headline": "",
        "next_step": None,
        "answer": (),
        "gear": CalibratedGear(basis.gear.name, basis.gear.material, basis.theory),
        "basis": basis.kind,
        "draws": basis.size,
        "interval": interval,
        "interval_kind": interval_kind,
    }


def in_words(found: D, headline: str, words: Iterable[str]) -> D:
    """Return an answer with its sentences."""
    step = next_step(found)
    return replace(found, headline=headline, next_step=step, answer=tuple(words))


def _counted(share: float, basis: DesignDraws) -> tuple[float, float]:
    """Return a probability that was counted among draws, and its standard error.

    That all draws do it does not make it certain: half a draw is left in doubt.
    """
    draws = basis.independent
    share = float(np.clip(share, 0.5 / draws, 1.0 - 0.5 / draws))
    return share, float(np.sqrt(share * (1.0 - share) / draws))


def generator_answer(found: WaveGenerator) -> GeneratorAnswer:
    """Return an elastic wave generator as an answer, ready for JSON."""
    levels = range(len(found.asked.temperature_C))
    told = GeneratorAnswer(
        **origin(found.basis, INTERVAL, found.gear.interval_kind(found.basis)),
        asked=found.asked,
        population=found.gear.words,
        spring=_spring(found),
        set_point=_set_point(found),
        force_N=tuple(_forces(found, level) for level in levels),
        at_temperature=tuple(_kept(found, level) for level in levels),
        adjusted=_adjusted(found),
        curve=_curve(found),
        stress=_window_stress(found),
        assumptions=tuple(assumptions(found.basis)),
        warnings=found.warnings,
    )
    return in_words(told, generator_headline(told), generator_words(told))


def generator_report(
    found: WaveGenerator, command: str = ""
) -> Report[GeneratorAnswer]:
    """Return all that `hdcal design --window` leaves behind."""

    def figures():
        from hdcal.design.figure import generator_figures

        return generator_figures(found)

    answer = generator_answer(found)
    return Report(generator_document(answer, command), answer, _FILE, figures)


def _curve(found: WaveGenerator) -> SpringCurve:
    counted = (
        tuple(_counted(getattr(one, name), found.basis)[0] for one in found.springs)
        for name in ("together", "no_backlash", "no_jam", "adjusted")
    )
    return SpringCurve(tuple(one.rate for one in found.springs), *counted)


def _signed(ends: np.ndarray, found: WaveGenerator) -> tuple[float, float]:
    low, high = ends.tolist()
    return ends_along(low, high, found.asked.sense)


def _spring(found: WaveGenerator) -> ChosenSpring:
    spring, sense, basis = found.chosen, found.asked.sense, found.basis
    probability, error = _counted(spring.together, basis)
    own = sense * np.median(found.forces[1, _reference(found)]) / _middle(found)
    return ChosenSpring(
        rate_N_per_mm=spring.rate,
        softest_considered=spring.rate == found.springs[0].rate,
        rate_over_gear=spring.rate / float(own),
        interference_mm=sense * spring.interference,
        probability=probability,
        standard_error=error,
        zero_backlash=_counted(spring.no_backlash, basis)[0],
        no_jam=_counted(spring.no_jam, basis)[0],
    )


def _middle(found: WaveGenerator) -> float:
    return 0.5 * sum(found.asked.window_mm)


def _reference(found: WaveGenerator) -> int:
    """Return which of the temperatures is nearest to the reference."""
    levels = np.asarray(found.asked.temperature_C)
    off = np.abs(levels - found.basis.gear.reference_temperature)
    return int(np.argmin(off))


def _set_point(found: WaveGenerator) -> SetPoint:
    """Return the aim: the middle of the window at the reference temperature."""
    level = _reference(found)
    return SetPoint(
        deformation_mm=_middle(found),
        temperature_C=found.asked.temperature_C[level],
        force_N=credible_interval(found.asked.sense * found.forces[1, level]),
    )


def _forces(found: WaveGenerator, level: int) -> WindowForces:
    sense = found.asked.sense
    ends = map(credible_interval, sense * found.forces[::sense, level])
    return WindowForces(found.asked.temperature_C[level], *ends)


def _kept(found: WaveGenerator, level: int) -> WindowKept:
    low, high = found.intervals(level)
    x = found.chosen.interference + found.error
    kept = x >= low, x <= high, (x >= low) & (x <= high)
    shares = (_counted(float(np.mean(each)), found.basis)[0] for each in kept)
    return WindowKept(found.asked.temperature_C[level], *shares)


def _adjusted(found: WaveGenerator) -> GearByGear:
    """Return the range of set points when each gear is given its own."""
    low, high = found.intervals()
    own = 0.5 * (low + high)
    ends = np.array(
        [0.5 - found.asked.probability / 2.0, 0.5 + found.asked.probability / 2.0]
    )
    reach = np.quantile(own, ends)
    load = found.chosen.rate * (reach - found.asked.sense * _middle(found))
    return GearByGear(
        probability=_counted(found.chosen.adjusted, found.basis)[0],
        share_of_gears=found.asked.probability,
        interference_mm=_signed(reach, found),
        preload_N=_signed(load, found),
    )


def _window_stress(found: WaveGenerator) -> StressAtWindow:
    basis, at = found.basis, found.asked.sizes_mm[1]
    rise = np.asarray(found.asked.temperature_C) - basis.gear.reference_temperature
    warm = np.max(1.0 - np.asarray(basis.values["alpha"])[:, None] * rise, axis=1)
    modulus = np.asarray(basis.values["E0"]) * warm
    made = found.gear.gears.made(basis.gear.geometry)
    draws = np.asarray(peak_stress(made, modulus, at))
    where = found.asked.sense * at
    return StressAtWindow(deformation_mm=where, **_stress(basis, draws))


def _stress(basis: DesignDraws, draws: np.ndarray) -> dict[str, Any]:
    """Return hoop bending stress and yield utilisation as intervals.

    Args:
        basis: tells the material.
        draws: stress of each draw [MPa].
    """
    strength = basis.yield_strength
    known = strength is not None
    return {
        "stress_MPa": credible_interval(draws),
        "yield_MPa": credible_interval(strength) if known else None,
        "utilisation": credible_interval(draws / strength) if known else None,
    }


def inverse_answer(found: InverseDesign) -> InverseAnswer:
    """Return an inverse design as an answer, ready for JSON."""
    told = InverseAnswer(
        **origin(found.basis, INTERVAL, found.gear.interval_kind(found.basis)),
        asked=found.asked,
        population=found.gear.words,
        design=_candidate(found.chosen, found.asked.sense),
        tested=_candidate(found.tested, found.asked.sense),
        candidates=tuple(
            _candidate(one, found.asked.sense) for one in found.candidates
        ),
        elasticities=found.elasticities,
        assumptions=tuple(assumptions(found.chosen.basis)),
        warnings=found.warnings,
    )
    return in_words(told, inverse_headline(told), inverse_words(told))


def inverse_report(found: InverseDesign, command: str = "") -> Report[InverseAnswer]:
    """Return all that `hdcal design --limit-force` leaves behind."""

    def figures():
        from hdcal.design.figure import inverse_figures

        return inverse_figures(found)

    answer = inverse_answer(found)
    return Report(inverse_document(answer, command), answer, _FILE, figures)


def _candidate(one: Candidate, sense: LoadingSense) -> CandidateAnswer:
    span = credible_interval(sense * one.forces)
    probability, error = _counted(one.kept, one.basis)
    return CandidateAnswer(
        material=one.basis.material,
        sizes_mm={name.removesuffix("_mm"): v for name, v in one.sizes.items()},
        met=one.met,
        change=one.change,
        force_N=CandidateForce(**vars(span), kept=sense * one.force),
        probability=probability,
        standard_error=error,
        **_stress(one.basis, one.stresses),
        utilisation_kept=one.utilisation,
    )
