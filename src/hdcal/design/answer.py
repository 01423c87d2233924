"""The JSON answers of designs: what each number in them is."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from hdcal.prediction.engine.loading_sense import (
    LoadingSense,
    ends_along,
    sense_of,
)
from hdcal.prediction.margin.result import Chance, Fraction, Size
from hdcal.report.answer import Answer, Count, Sentences, Words
from hdcal.report.parameters import Interval
from hdcal.report.posterior_answer import CalibratedGear

Numbers = tuple[float, ...]
Ends = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class DesignAnswer(Answer):
    """What the answers of designs and studies share.

    Attributes:
        gear: that the draws belong to.
        basis: whether the draws are a posterior's or a prior's.
        draws: number of them.
        interval: probability inside the intervals.
        interval_kind: what kind of interval they are.
        answer: the answer in sentences.
        assumptions: what is taken for granted.
        warnings: what is extrapolated.
    """

    status: Literal["ok"] = "ok"
    gear: CalibratedGear
    basis: Literal["posterior", "prior"]
    draws: Count
    interval: Fraction
    interval_kind: Words
    answer: Sentences
    assumptions: Sentences
    warnings: Sentences


@dataclass(frozen=True, kw_only=True)
class StressAnswer:
    """Size of the hoop bending stress, yield strength if known, and their ratio."""

    stress_MPa: Interval
    yield_MPa: Interval | None
    utilisation: Interval | None


@dataclass(frozen=True, kw_only=True)
class StressAtWindow(StressAnswer):
    """The same at the end of a window that is the farther one from zero."""

    deformation_mm: float


@dataclass(frozen=True)
class WindowAsked:
    """What a wave generator was asked for.

    Attributes:
        window_mm: lo and hi of the deformation, of one sign.
        temperature_C: at all of which it has to hold.
        probability: with which it has to hold.
        setting_sd_mm: scatter of the set point as built.
        tolerances_mm: ± of sizes by edge name.
    """

    window_mm: Ends
    temperature_C: Numbers
    probability: Fraction
    setting_sd_mm: Size
    tolerances_mm: Mapping[str, Size]

    @property
    def sense(self) -> LoadingSense:
        """Sense of loading: forces and set points have its sign."""
        return sense_of(sum(self.window_mm))

    @property
    def sizes_mm(self) -> Ends:
        """Least deformation (less: backlash) and largest (more: jam) in size."""
        return ends_along(*self.window_mm, self.sense)


@dataclass(frozen=True)
class ChosenSpring:
    """The softest spring that meets the window, with one set point for every gear."""

    rate_N_per_mm: float
    softest_considered: bool
    rate_over_gear: float
    interference_mm: float
    probability: Chance
    standard_error: Size
    zero_backlash: Chance
    no_jam: Chance


@dataclass(frozen=True)
class SetPoint:
    """The middle of the window at the temperature nearest to the reference."""

    deformation_mm: float
    temperature_C: float
    force_N: Interval


@dataclass(frozen=True)
class WindowForces:
    """Forces at both ends and the middle of the window, at one temperature."""

    temperature_C: float
    at_lo: Interval
    at_middle: Interval
    at_hi: Interval


@dataclass(frozen=True)
class WindowKept:
    """Probabilities with one set point for every gear, at one temperature."""

    temperature_C: float
    zero_backlash: Chance
    no_jam: Chance
    inside: Chance


@dataclass(frozen=True)
class GearByGear:
    """What adjusting the set point gear by gear does with the same spring."""

    probability: Chance
    share_of_gears: Fraction
    interference_mm: Ends
    preload_N: Ends


@dataclass(frozen=True)
class SpringCurve:
    """Probabilities over the spring rate."""

    rate_N_per_mm: Numbers
    common: tuple[Chance, ...]
    zero_backlash: tuple[Chance, ...]
    no_jam: tuple[Chance, ...]
    adjusted: tuple[Chance, ...]


@dataclass(frozen=True, kw_only=True)
class GeneratorAnswer(DesignAnswer):
    """What `hdcal design --window` answers; design.json."""

    schema: Literal["hdcal.design/1"] = "hdcal.design/1"
    kind: Literal["wave_generator"] = "wave_generator"
    asked: WindowAsked
    population: Words
    spring: ChosenSpring
    set_point: SetPoint
    force_N: tuple[WindowForces, ...]
    at_temperature: tuple[WindowKept, ...]
    adjusted: GearByGear
    curve: SpringCurve
    stress: StressAtWindow


@dataclass(frozen=True)
class LimitAsked:
    """What an inverse design was asked for.

    Attributes:
        deformation_mm: radial, of the gear.
        temperature_C: at all of which the limits hold.
        limit_force_N: that must not be exceeded, its size.
        limit_stress_MPa: hoop bending; None for the yield strength, if one is known.
        probability: share of the draws that have to keep each limit.
        bounds: of each free size [mm] by edge name.
        tolerances_mm: ± of sizes by edge name.
    """

    deformation_mm: float
    temperature_C: Numbers
    limit_force_N: float
    limit_stress_MPa: float | None
    probability: Fraction
    bounds: Mapping[str, Ends]
    tolerances_mm: Mapping[str, Size]

    @property
    def sense(self) -> LoadingSense:
        """Sense of loading: forces have its sign, limits are along it."""
        return sense_of(self.deformation_mm)


@dataclass(frozen=True)
class CandidateForce(Interval):
    """A force, and the one that is kept with the required probability."""

    kept: float


@dataclass(frozen=True, kw_only=True)
class CandidateAnswer(StressAnswer):
    """One material with the sizes that were found best for it."""

    material: str
    sizes_mm: Mapping[str, float]
    met: bool
    change: Size
    force_N: CandidateForce
    probability: Chance
    standard_error: Size
    utilisation_kept: float | None


@dataclass(frozen=True, kw_only=True)
class InverseAnswer(DesignAnswer):
    """What `hdcal design --limit-force` answers; design.json."""

    schema: Literal["hdcal.design/1"] = "hdcal.design/1"
    kind: Literal["inverse_geometry"] = "inverse_geometry"
    asked: LimitAsked
    population: Words
    design: CandidateAnswer
    tested: CandidateAnswer
    candidates: tuple[CandidateAnswer, ...]
    elasticities: Mapping[str, float]

    @property
    def as_tested(self) -> bool:
        """Whether the chosen design is the tested gear itself."""
        own = self.design.material == self.tested.material
        return own and self.design.change < 1e-9
