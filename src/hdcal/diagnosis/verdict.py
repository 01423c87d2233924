"""The answer of a diagnosis, as typed values; views turn them into files and words."""

from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np

from hdcal.data.case import Case
from hdcal.data.records import Records
from hdcal.diagnosis.budget import Budget
from hdcal.inference.hypotheses import LeftOut
from hdcal.inference.posterior import Posterior
from hdcal.notebook import Shown
from hdcal.report.answer import Count, EffectName, Probability, Promise, Real, Words
from hdcal.report.parameters import Interval

VerdictWord = Literal["none", "named", "ambiguous", "unknown"]
_PAIR = "^[A-Za-z_][A-Za-z0-9_]*(\\+[A-Za-z_][A-Za-z0-9_]*)?$"
Chances = Annotated[
    dict[str, Probability],
    Promise(required=["none", "unknown"], propertyNames={"pattern": _PAIR}),
]


@dataclass(frozen=True)
class Gap:
    """Whether model and measurement part, and by how much.

    Attributes:
        detected: the residual test is significant at 5 %.
        probability: posterior probability that anything is missing (1 − P(none)).
        rms_N: root mean square of the gap at the tested rows, 90 % interval; NaN
            where none is detected.
        noise_sd_N: of a reading, without the gap.
        share_of_full_scale: rms over the largest tested force [-].
        autocorrelation: posterior mean of the noise's AR(1) coefficient [-].
        rounding_N: step of rounded readings, where nothing else is detected.
    """

    detected: bool
    probability: Probability
    rms_N: Interval
    noise_sd_N: Real
    share_of_full_scale: Real
    autocorrelation: Real
    rounding_N: Real | None = None


@dataclass(frozen=True)
class Cell:
    """One pre-declared cell of the rows and the mean residual in it.

    Attributes:
        covariate: deformation, temperature, time, angle, direction, run, specimen
            or a product such as `direction × deformation`.
        label: for people, such as "0.36 … 0.54 mm" or "unloading".
        from_: lower end in `unit`; NaN for labels.
        to: upper end; NaN for labels.
        unit: mm, °C, s, rad or "".
        rows: number of rows.
        bias_N: mean reading minus calibrated model, with the simultaneous 95 % band of
            noise around it.
        z: bias over its standard error under no gap.
        share: of the squared gap that lies in this cell [-].
    """

    covariate: Words
    label: str
    from_: Real
    to: Real
    unit: str
    rows: Count
    bias_N: Interval
    z: Real
    share: Real

    @property
    def hot(self) -> bool:
        """Whether the bias leaves the simultaneous band."""
        return self.bias_N.lo > 0.0 or self.bias_N.hi < 0.0


@dataclass(frozen=True)
class CovariateShare:
    """Part of the gap's variance along one covariate, 90 % interval."""

    covariate: Words
    share: Interval


@dataclass(frozen=True)
class Where:
    """Where the gap lies.

    Attributes:
        p_value: family-wise, of the residual test.
        statistics: largest |z| over the cells and of the noise's shape, by name.
        cells: every pre-declared cell.
        shares: of the gap's variance by covariate; empty when no gap is detected.
        residual_N: reading minus calibrated base model, shape (n,).
        gap_N: smooth part of it (posterior mean), shape (n,).
        records: the rows that were looked at: the case's own, or means of neighbours.
    """

    p_value: float
    statistics: dict[str, float]
    cells: tuple[Cell, ...]
    shares: tuple[CovariateShare, ...]
    residual_N: np.ndarray
    gap_N: np.ndarray
    records: Records

    @property
    def regions(self) -> tuple[Cell, ...]:
        """Return the hot cells, largest |z| first."""
        return tuple(sorted((c for c in self.cells if c.hot), key=lambda c: -abs(c.z)))


@dataclass(frozen=True)
class Amplitude(Interval):
    """Size of the named effect, 90 % credible interval."""

    effect: EffectName
    parameter: Words
    unit: str


@dataclass(frozen=True)
class NotTestable:
    """An effect, and what the records lack to show it."""

    effect: EffectName
    needs: Annotated[tuple[Words, ...], Promise(minItems=1)]


@dataclass(frozen=True)
class Which:
    """Which unmodelled effect causes the gap.

    Attributes:
        verdict: none, named, ambiguous or unknown.
        effect: top effect by inclusion; None for none and unknown.
        second_effect: another with inclusion of 90 % or more.
        set: effects of the smallest set of hypotheses with 90 %, most probable first.
        probabilities: of all hypotheses; sum to 1.
        inclusion: of each effect over singles and pairs.
        log_evidence: of each hypothesis, relative to none [nat].
        amplitude: of `effect`; None without one.
        not_testable: effects that these records cannot show.
        not_excited: effects that this loading cannot show at a physical size.
        inseparable: pairs of effects that this loading can never tell apart.
        sensitivity: top inclusion for amplitude priors ⅓ and 3 times as wide.
        stability: share of block-bootstrap samples with the same top hypothesis.
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
        closed: share of the gap closed on blocks it was not fitted to, 90 % interval.
        held_out: what was left out, such as `leave-one-half-cycle-out`.
        extrapolated_closed: with the upper third of the deformation left out.
        placebo_closed: by a free spline of as many parameters.
        remainder_N: rms of what is left after the effect, 90 % interval.
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
        separates: effects whose ranking it would settle, most of all first.
        information_nats: expected information about which effect it is.
        cost: in words, such as "one ramp".
    """

    run: Words
    separates: tuple[EffectName, ...]
    information_nats: Real
    cost: str


@dataclass(frozen=True)
class Verdict(Shown):
    """Where, which, how far, and what to do next.

    Attributes:
        case: the case diagnosed.
        gap: whether there is a gap.
        where: where it lies.
        which: what causes it.
        shrink: how far it closes once the effect is added.
        next_test: runs that would tell more, best first.
        budget: of the scale factor K.
        posteriors: calibrated models by hypothesis (effects joined with +), with the
            probability that weighs their bands, sum 1; empty with `quick`.
        left_out: probability without a model of its own, and which one carries it.
        library: names of the effects that were considered.
        notes: remarks, such as rows thinned.
        reasons: why the result must not be used; empty when it may.
        averaged_rows: rows in each mean that was diagnosed; 1 is single rows.
        no_run: why `next_test` is empty.
        seed: of the simulations and the sampler.
        quick: nothing was sampled.
    """

    case: Case
    gap: Gap
    where: Where
    which: Which
    shrink: Closure
    next_test: tuple[NextRun, ...]
    budget: Budget
    posteriors: dict[str, tuple[float, Posterior]]
    library: tuple[str, ...]
    left_out: LeftOut | None = None
    notes: tuple[str, ...] = ()
    reasons: tuple[str, ...] = ()
    averaged_rows: int = 1
    no_run: str = ""
    seed: int = 0
    quick: bool = False

    @property
    def status(self) -> Literal["ok", "failed"]:
        """Return whether the result may be used."""
        return "failed" if self.reasons else "ok"
