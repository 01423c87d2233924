"""The JSON answer of a diagnosis, verdict.json: what each number in it is."""

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from hdcal.diagnosis.verdict import (
    Budget,
    Closure,
    CovariateShare,
    Gap,
    NextRun,
    VerdictWord,
)
from hdcal.report.answer import (
    Answer,
    Count,
    Digest,
    EffectName,
    Probability,
    Promise,
    Real,
    Sentences,
    Words,
)
from hdcal.report.parameters import Interval
from hdcal.report.posterior_answer import CalibratedGear

_PAIR = "^[A-Za-z_][A-Za-z0-9_]*(\\+[A-Za-z_][A-Za-z0-9_]*)?$"
Chances = Annotated[
    dict[str, Probability],
    Promise(required=["none", "unknown"], propertyNames={"pattern": _PAIR}),
]


def _if(condition: dict, then: dict) -> dict:
    return {"if": {"properties": condition}, "then": {"properties": then}}


def _inside(part: str, rules: dict) -> dict:
    return {part: {"properties": rules}}


@dataclass(frozen=True)
class CellAnswer:
    """One cell of the rows and the mean residual in it, simultaneous 95 % band."""

    covariate: Words
    label: str
    from_: Real
    to: Real
    unit: str
    rows: Count
    bias_N: Interval
    z: Real
    share: Real


@dataclass(frozen=True)
class WhereAnswer:
    """Where the gap lies: `cells` were declared beforehand, `regions` are off."""

    p_value: Probability
    statistics: dict[str, Real]
    shares: tuple[CovariateShare, ...]
    regions: tuple[CellAnswer, ...]
    cells: tuple[CellAnswer, ...]


@dataclass(frozen=True)
class AmplitudeAnswer(Interval):
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
class WhichAnswer:
    """Which unmodelled effect causes the gap; see `Which`."""

    verdict: VerdictWord
    effect: EffectName | None
    second_effect: EffectName | None
    set: Annotated[tuple[EffectName, ...], Promise(uniqueItems=True)]
    probabilities: Chances
    inclusion: dict[str, Probability]
    log_evidence: dict[str, Real]
    amplitude: AmplitudeAnswer | None
    not_testable: tuple[NotTestable, ...]
    not_excited: tuple[EffectName, ...]
    inseparable: tuple[tuple[EffectName, EffectName], ...]
    sensitivity: dict[str, Real]
    stability: Probability | None


@dataclass(frozen=True)
class Refit:
    """A corrected model that was calibrated, and its file in the folder."""

    hypothesis: Words
    probability: Probability
    file: Annotated[str, Promise(pattern="^posterior[^/\\\\]*\\.nc$")]


@dataclass(frozen=True)
class DiagnosedData:
    """Which data they were; `averaged_rows` in each mean that was diagnosed."""

    name: str
    rows: Annotated[int, Promise(minimum=1)]
    averaged_rows: Annotated[int, Promise(minimum=1)]
    rows_diagnosed: Annotated[int, Promise(minimum=1)]
    sha256: Digest
    notes: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class VerdictAnswer(Answer):
    """What `hdcal diagnose` answers of one case; verdict.json."""

    RULES: ClassVar = (
        *Answer.RULES,
        _if({"status": {"const": "failed"}}, {"answer": {"maxItems": 0}}),
        _if({"status": {"const": "ok"}}, {"answer": {"minItems": 1}}),
        _if({"next_test": {"maxItems": 0}}, {"next_test_reason": {"minLength": 1}}),
        _if(
            _inside("gap", {"detected": {"const": False}}),
            _inside(
                "gap",
                {
                    **_inside("rms_N", {"median": {"type": "null"}}),
                    "share_of_full_scale": {"type": "null"},
                },
            ),
        ),
        _if(
            _inside("shrink", {"closed": {"type": "null"}}),
            _inside("shrink", {"reason": {"minLength": 1}}),
        ),
        _if(
            _inside("which", {"verdict": {"enum": ["none", "unknown"]}}),
            _inside("which", {"effect": {"type": "null"}}),
        ),
        _if(
            _inside("which", {"verdict": {"enum": ["named", "ambiguous"]}}),
            _inside("which", {"effect": {"type": "string"}}),
        ),
    )

    schema: Literal["hdcal.verdict/1"] = "hdcal.verdict/1"
    answer: Sentences
    limits: Sentences
    interval: float
    gap: Gap
    where: WhereAnswer
    which: WhichAnswer
    shrink: Closure
    next_test: tuple[NextRun, ...]
    next_test_reason: str
    budget: Budget
    refits: tuple[Refit, ...]
    library: tuple[EffectName, ...]
    notes: tuple[str, ...]
    seed: Count
    quick: bool
    versions: Annotated[dict[str, str], Promise(required=["hdcal"])]
    gear: CalibratedGear
    data: DiagnosedData


@dataclass(frozen=True, kw_only=True)
class VerdictsAnswer(Answer):
    """What `hdcal diagnose` answers of many cases, each by its name."""

    schema: Literal["hdcal.verdicts/1"] = "hdcal.verdicts/1"
    cases: dict[str, VerdictAnswer]
