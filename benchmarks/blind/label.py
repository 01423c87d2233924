"""The truth about a case, and an answer to it."""

from dataclasses import field
from typing import Literal

from pydantic import ConfigDict, TypeAdapter
from pydantic.dataclasses import dataclass

CaseKind = Literal["null", "effect", "pair", "composite", "outside", "real"]
Quantiles = tuple[float, float, float]
_STRICT = ConfigDict(extra="forbid", ser_json_inf_nan="constants")
NONE, UNKNOWN = "none", "unknown"


@dataclass(frozen=True, config=_STRICT)
class Label:
    """The truth about one case.

    Attributes:
        case: name of the case, the stem of its CSV.
        kind: null (no gap), effect (one of the library's), pair (two of them),
            composite (one of them together with a mechanism outside the library),
            outside (outside the library alone), real (measured, with a stated cause).
        truth: names of the active mechanisms; of measured data, of accepted answers.
        program: name of the loading.
        rows: number of readings n.
        r: RMS of what the mechanisms leave after calibration, over the noise sd.
        noise: iid, ar (serial), or log (read faster than the rig moves).
        correlation: AR(1) coefficient of the noise.
        sigma: sd of the noise [N].
        mix: the part of the check that the case belongs to.
        withheld: effects taken out of the library for this case.
        clean: readings without noise [N].
        curve: what the mechanisms leave after calibration [N].
        amplitude: true value of the library parameter `effect.parameter`, where the
            mechanism has the same, in the library's unit.
        outside: mechanism outside the library in a composite.
        share: share of the effect in the mean square of a composite's gap.
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
    mix: str = ""
    withheld: tuple[str, ...] = ()
    clean: tuple[float, ...] = ()
    curve: tuple[float, ...] = ()
    amplitude: dict[str, float] = field(default_factory=dict)
    outside: str = ""
    share: float = 1.0


@dataclass(frozen=True, config=_STRICT)
class Answer:
    """The answer of a diagnoser to one case, in the terms of verdict.json.

    Attributes:
        case: name of the case.
        verdict: none, named, group, ambiguous or unknown.
        effect: most probable effect, None where nothing is named.
        second_effect: another that is present as well.
        set: smallest set of hypotheses with 90 %, most probable first.
        probabilities: of all hypotheses; they sum to 1.
        inclusion: of each effect over all hypotheses that contain it.
        detected: whether a gap is detected.
        gap: RMS of the gap, quantiles .5, .025, .975 [N].
        amplitude: of a parameter `effect.parameter`, the same quantiles.
        closed: share of the gap closed on held-out rows, the same quantiles.
        group: leading group of effects, several where they cannot be separated.
        group_members: its effects.
    """

    case: str
    verdict: Literal["none", "named", "group", "ambiguous", "unknown"]
    effect: str | None
    second_effect: str | None
    set: tuple[str, ...]
    probabilities: dict[str, float]
    inclusion: dict[str, float]
    detected: bool
    gap: Quantiles | None = None
    amplitude: dict[str, Quantiles] = field(default_factory=dict)
    closed: Quantiles | None = None
    group: tuple[str, ...] = ()
    group_members: tuple[str, ...] = ()


LABEL, ANSWER = TypeAdapter(Label), TypeAdapter(Answer)
