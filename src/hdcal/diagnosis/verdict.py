"""The answer of a diagnosis, as typed values; views turn them into files and words."""

from dataclasses import dataclass, field
from typing import Annotated, Literal

from hdcal.data.case import Case
from hdcal.diagnosis.budget import Budget
from hdcal.diagnosis.gap import Gap, Seen, Where
from hdcal.inference.model_average import LeftOut
from hdcal.inference.posterior import Posterior
from hdcal.notebook import Shown
from hdcal.report.answer import (
    Count,
    EffectName,
    Probability,
    Promise,
    Real,
    Words,
)
from hdcal.report.intervals import Interval

VerdictWord = Literal["none", "named", "group", "ambiguous", "unknown"]
_PAIR = "^[A-Za-z_][A-Za-z0-9_]*(\\+[A-Za-z_][A-Za-z0-9_]*)?$"
Chances = Annotated[
    dict[str, Probability],
    Promise(required=["none", "unknown"], propertyNames={"pattern": _PAIR}),
]


@dataclass(frozen=True)
class Amplitude(Interval):
    """Size of the named effect, 95 % credible interval."""

    effect: EffectName
    parameter: Words
    unit: str


@dataclass(frozen=True)
class NotTestable:
    """An effect, and what the records lack to show it."""

    effect: EffectName
    needs: Annotated[tuple[Words, ...], Promise(minItems=1)]


@dataclass(frozen=True)
class Remainder:
    """What lies beside the leading effect and is in no library.

    Attributes:
        probability: that there is some, given the effect.
        share: of the gap that it is, by rms, 95 % interval.
    """

    probability: Probability
    share: Interval


@dataclass(frozen=True)
class Certificate:
    """How often such answers were wrong in a blind check, no effect withheld.

    Attributes:
        said: how often such an answer, a name or a group, was given there.
        wrong: how often that was wrong.
        at_most: share that is wrong at most, with a confidence of 95 %.
    """

    said: Count
    wrong: Count
    at_most: Probability


@dataclass(frozen=True)
class Which:
    """Which unmodelled effect causes the gap.

    Attributes:
        verdict: none, named, group, ambiguous or unknown.
        effect: top effect by inclusion, under `group` of that group; None for none
            and unknown.
        second_effect: another with inclusion of 97 % or more; where nothing is named
            also that of a pair with 50 % or more.
        set: effects of the smallest set of hypotheses with 90 %, most probable first.
        probabilities: of all hypotheses; sum to 1.
        inclusion: of each effect over all hypotheses that hold it.
        log_evidence: of each hypothesis, relative to none [nat].
        amplitude: of `effect`; None without one.
        not_testable: effects that these records cannot show.
        not_excited: effects that this loading cannot show at a physical size.
        inseparable: pairs of effects that this loading can never tell apart.
        sensitivity: top inclusion for amplitude priors ⅓ and 3 times as wide.
        stability: share of block-bootstrap samples with the same top hypothesis.
        group: leading group of causes; several joined by a slash where this loading
            cannot part them. None for none and unknown.
        group_members: effects of it.
        group_probability: that the cause is one of them.
        groups: probability of each group; an effect may be in two.
        remainder: beside `effect`; None without one.
        doubted: the likeliest hypothesis leaves more than noise.
        lookalikes: effects that these records cannot show and that would look like
            `effect` in them.
        lookalike_cases: cases of blind checks that `effect` alone described.
        lookalike_rate: share of these in which another cause acted; None if they were
            too few to tell.
        describes_best: `effect` alone describes the gap, but other causes look like it
            too often for a name.
        certificate: of such an answer; None where neither group nor effect is said, or
            by another library.
    """

    verdict: VerdictWord
    effect: EffectName | None
    second_effect: EffectName | None
    set: Annotated[tuple[EffectName, ...], Promise(uniqueItems=True)]
    probabilities: Chances
    inclusion: dict[str, Probability]
    log_evidence: dict[str, Real]
    amplitude: Amplitude | None
    not_testable: tuple[NotTestable, ...]
    not_excited: tuple[EffectName, ...]
    inseparable: tuple[tuple[EffectName, EffectName], ...]
    sensitivity: dict[str, Real]
    stability: Probability | None
    group: Words | None = None
    group_members: Annotated[tuple[EffectName, ...], Promise(uniqueItems=True)] = ()
    group_probability: Probability | None = None
    groups: dict[str, Probability] = field(default_factory=dict)
    remainder: Remainder | None = None
    doubted: bool = False
    lookalikes: tuple[NotTestable, ...] = ()
    lookalike_cases: Count = 0
    lookalike_rate: Probability | None = None
    describes_best: bool = False
    certificate: Certificate | None = None

    @property
    def named(self) -> tuple[str, ...]:
        """Return the effects that are named, none to two."""
        return tuple(name for name in (self.effect, self.second_effect) if name)


@dataclass(frozen=True)
class LadderEntry:
    """Error of one model, from the nominal one down to the noise."""

    model: Words
    rms_N: Real


@dataclass(frozen=True)
class Closure:
    """How far the gap closes once the effect is added.

    Attributes:
        ladder: nominal, calibrated, with the effect, with the remainder, noise.
        closed: share of the gap closed on blocks it was not fitted to, 95 % interval.
        held_out: what was left out, such as `leave-one-half-cycle-out`.
        extrapolated_closed: with the upper third of the deformation left out.
        placebo_closed: by a free spline of as many parameters.
        remainder_N: rms of what is left after the effect, 95 % interval.
        reason: why `closed` is missing.
        bars: closed share of each member of the set, by effect.
    """

    ladder: tuple[LadderEntry, ...]
    closed: Interval | None
    held_out: str
    extrapolated_closed: Real | None
    placebo_closed: Real | None
    remainder_N: Interval | None
    reason: str
    bars: dict[str, Real] = field(default_factory=dict)


@dataclass(frozen=True)
class NextRun:
    """One run that a rig can do and what it would tell.

    Attributes:
        run: what to do, in words.
        separates: the two hypotheses that it would tell apart best, effects joined
            with +.
        information_nats: expected information about which effect it is.
        cost: in words, such as "one ramp".
    """

    run: Words
    separates: tuple[Words, ...]
    information_nats: Real
    cost: str


@dataclass(frozen=True, repr=False)
class Verdict(Shown):
    """Where, which, how far, and what to do next.

    Attributes:
        case: the case diagnosed.
        gap: whether there is a gap.
        where: where it lies.
        which: what causes it.
        shrink: how far it closes once the effect is added.
        next_test: runs that would tell more, best first.
        budget: of the scale factor K; None where K is the stiffness itself.
        posteriors: calibrated models by hypothesis (effects joined with +), with the
            probability that weighs their bands, sum 1; empty with `quick`.
        left_out: probability without a model of its own, and which one carries it.
        library: names of the effects that were considered.
        notes: remarks, such as rows thinned.
        reasons: why the result must not be used; empty when it may.
        averaged_rows: rows in each mean that was diagnosed; 1 is single rows.
        row_step: one of so many rows, or means, was diagnosed.
        no_run: why `next_test` is empty.
        seen: what readings show, the clearest first.
        seed: of the simulations and the sampler.
        quick: nothing was sampled.
    """

    case: Case
    gap: Gap
    where: Where
    which: Which
    shrink: Closure
    next_test: tuple[NextRun, ...]
    budget: Budget | None
    posteriors: dict[str, tuple[float, Posterior]]
    library: tuple[str, ...]
    left_out: LeftOut | None = None
    notes: tuple[str, ...] = ()
    reasons: tuple[str, ...] = ()
    averaged_rows: int = 1
    row_step: int = 1
    no_run: str = ""
    seen: tuple[Seen, ...] = ()
    seed: int = 0
    quick: bool = False

    @property
    def status(self) -> Literal["ok", "failed"]:
        """Return whether the result may be used."""
        return "failed" if self.reasons else "ok"
