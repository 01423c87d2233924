"""The answer of `margin`: what each number in it is."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from hdcal.notebook import Shown
from hdcal.prediction.engine.conditions import Direction
from hdcal.prediction.engine.forces import Quantity
from hdcal.prediction.engine.loading_sense import LoadingSense, ends_along
from hdcal.prediction.engine.population import Population
from hdcal.prediction.margin.deformation_reached import DeformationReached
from hdcal.prediction.margin.gradients import Gradient
from hdcal.prediction.margin.stated import Chance, Decision, Size, StatedUncertainty
from hdcal.prediction.margin.variance_shares import VarianceShare
from hdcal.prediction.shares import BASES
from hdcal.quantities import FORCE
from hdcal.report.answer import Promise, Real, Sentences, Units, Words
from hdcal.report.intervals import Interval

INTERVAL = 0.95
Fraction = Annotated[float, Promise(exclusiveMinimum=0, exclusiveMaximum=1)]
# Beyond the tested range by more than this share of it a bound rests on an assumption.
FAR = 0.2
# One whose ends are all known.
Span = Annotated[Interval, Promise(additionalProperties={"type": "number"})]


@dataclass(frozen=True)
class Exceedance:
    """How probable it is that a member needs more than the capacity.

    Attributes:
        probability: of one future member, all that is unknown averaged over.
        lo: lower end of the 95 % interval of the share of the population.
        hi: its upper end.
        at_confidence: share that is not exceeded with the stated confidence.
        beta: reliability index −Φ⁻¹(P) of the probability.
        beta_lo: of `hi`.
        beta_hi: of `lo`.
        beta_at_confidence: of `at_confidence`.
        relative_error: Monte Carlo standard error over the probability.
        rests_on: what a rare one rests on; None where it is not rare.
    """

    probability: Chance
    lo: Chance
    hi: Chance
    at_confidence: Chance
    beta: Real
    beta_lo: Real
    beta_hi: Real
    beta_at_confidence: Real
    relative_error: Real
    rests_on: Words | None


@dataclass(frozen=True)
class Level:
    """The force at one temperature, or at the worst one of a window.

    Attributes:
        temperature_C: of the specimen.
        tested: the data hold this deformation, temperature and direction.
        force_N: mean of the population, with its 95 % credible interval.
        member_N: of one future member, with its 95 % predictive interval.
        lower_bound_N: exceeded by the share `content`, with the stated confidence.
        upper_bound_N: not exceeded by that share, with that confidence.
        capacity_N: smallest that meets the required probability, with confidence; as
            all capacities a size, along the sense of loading.
        capacity_median_N: the same with a confidence of a half.
        capacity_predictive_N: the same for one future member, all that is unknown
            averaged over.
        exceedance: of the given capacity, or None.
    """

    temperature_C: float
    tested: bool
    force_N: Span
    member_N: Span
    lower_bound_N: float
    upper_bound_N: float
    capacity_N: float
    capacity_median_N: float
    capacity_predictive_N: float
    exceedance: Exceedance | None


@dataclass(frozen=True)
class ModelBound:
    """What one of several models alone would say.

    Attributes:
        model: effects of the model, joined with +; `none` or `unknown` without any.
        probability: its weight.
        lower_bound_N: at the worst temperature.
        upper_bound_N: likewise.
        probability_exceeded: predictive, at the worst temperature, or None.
    """

    model: str
    probability: Chance
    lower_bound_N: float
    upper_bound_N: float
    probability_exceeded: Chance | None


def sizes_needed(of: Level | ModelBound, sense: LoadingSense) -> tuple[float, float]:
    """Return what most need at least and at most, along the sense of loading [N]."""
    return ends_along(of.lower_bound_N, of.upper_bound_N, sense)


@dataclass(frozen=True, kw_only=True, repr=False)
class Margin(StatedUncertainty, Shown):
    """The force needed at a deformation, and the margin of a capacity.

    Attributes:
        deformation_mm: as read.
        direction: up to load, down to unload.
        loading_sense: +1 pressed, −1 pulled; capacities and what exceeds them are
            along it, forces and bounds have their sign.
        quantity: reading of the rig, or load on the gear.
        population: readings, mountings or specimens.
        population_words: the same in a sentence.
        basis: A-basis, B-basis, or empty.
        content: share of the population within each bound, one-sided.
        confidence: of each bound.
        required_probability: that the capacities are to meet.
        limit_force_N: capacity asked about, its size, or None.
        tolerances_mm: ± of the sizes, by name.
        levels: one per temperature.
        worst: over all temperatures at once.
        reached: deformation reached by a given force, or None.
        decision: whether the force keeps the limit, or None without one.
        models: each model's own bounds, if there are several.
        causes: probability of each hypothesis that was averaged over.
        weight_left_out: of it, what lay on hypotheses without a model of their own.
        gradients: of the bound that is the larger one in size.
        shares: of the variance of one future member's force.
        beyond_tested: how far the deformation lies outside the tested range, as a
            share of that range.
        extrapolated: what lies outside the data, in sentences.
        remarks: what else to know, in sentences.
        units: names and units of what was measured; no part of the JSON answer.
    """

    deformation_mm: float
    direction: Direction
    loading_sense: LoadingSense
    quantity: Quantity
    population: Population
    population_words: Words
    basis: Annotated[str, Promise(enum=["", *BASES])]
    content: Fraction
    confidence: Fraction
    required_probability: Fraction
    limit_force_N: float | None
    tolerances_mm: Mapping[str, Size]
    levels: Annotated[tuple[Level, ...], Promise(minItems=1)]
    worst: Level
    reached: DeformationReached | None
    decision: Decision | None
    models: tuple[ModelBound, ...]
    causes: Mapping[str, Chance]
    weight_left_out: Chance
    gradients: tuple[Gradient, ...]
    shares: tuple[VarianceShare, ...]
    beyond_tested: Size
    extrapolated: Sentences
    remarks: Sentences
    units: Units = FORCE
