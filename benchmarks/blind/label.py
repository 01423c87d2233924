"""The truth about a case, and an answer to it."""

from typing import Literal

from pydantic import ConfigDict, TypeAdapter
from pydantic.dataclasses import dataclass

CaseKind = Literal["null", "effect", "composite", "outside", "real"]
Quantiles = tuple[float, float, float]
_STRICT = ConfigDict(extra="forbid", ser_json_inf_nan="constants")
# Explanations that are no effects of the library.
NONE, OUTSIDE = "none", "outside"


@dataclass(frozen=True, config=_STRICT)
class Label:
    """The truth about one case.

    Attributes:
        case: name of the case, the stem of its CSV.
        kind: null (no gap), effect (one of the library's), composite (one of them
            together with a mechanism outside the library), outside (outside the
            library alone), real (measured, with a stated cause).
        truth: names of the active mechanisms; of measured data, of accepted answers.
        program: name of the loading.
        rows: number of readings n.
        r: RMS of what the mechanisms leave after calibration, over the noise sd.
        noise: iid, ar (serial), strong, or log (read faster than the rig moves).
        correlation: AR(1) coefficient of the noise.
        sigma: sd of the noise [N].
        withheld: effects taken out of the library for this case.
        clean: readings without noise [N].
        curve: what the mechanisms leave after calibration [N].
        outside: mechanism outside the library in a composite.
        share: of the effect in the mean square of a composite's gap.
    """

    case: str
    kind: CaseKind
    truth: tuple[str, ...]
    program: str
    rows: int
    r: float
    noise: str
    correlation: float
    sigma: float
    withheld: tuple[str, ...] = ()
    clean: tuple[float, ...] = ()
    curve: tuple[float, ...] = ()
    outside: str = ""
    share: float = 1.0


@dataclass(frozen=True, config=_STRICT)
class Cause:
    """Effects that a diagnoser does not separate, or what is outside the library.

    Attributes:
        members: names of the effects, or `OUTSIDE`.
        acts: probability that one of them acts, alone or beside something else.
        explains: share of the gap's rms that they close where they act, 1 less the rms
            of what is left over that of the gap; quantiles .5, .025, .975.
    """

    members: tuple[str, ...]
    acts: float
    explains: Quantiles | None = None


@dataclass(frozen=True, config=_STRICT)
class Answer:
    """The answer of a diagnoser to one case.

    Attributes:
        case: name of the case.
        gap: probability that something acts.
        explanations: probability of each, summing to 1; names are those of its effects
            in alphabetical order, joined with +, or `NONE` or `OUTSIDE`.
        set: smallest set of explanations with 90 %, most probable first.
        inclusion: probability that each effect of the library acts.
        classes: of effects that may act; an effect is in one at most.
        outside: that something outside the library acts.
        gap_N: RMS of the gap, quantiles .5, .025, .975 [N].
        fits: whether the likeliest explanation fits; if not, no cause is stated.
    """

    case: str
    gap: float
    explanations: dict[str, float]
    set: tuple[str, ...]
    inclusion: dict[str, float]
    classes: tuple[Cause, ...]
    outside: Cause = Cause((OUTSIDE,), 0.0)
    gap_N: Quantiles | None = None
    fits: bool = True

    @property
    def detected(self) -> bool:
        """Whether a gap is more probable than none."""
        return self.gap > 0.5


LABEL, ANSWER = TypeAdapter(Label), TypeAdapter(Answer)
