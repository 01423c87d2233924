"""The JSON answer of a diagnosis, verdict.json: what each number in it is."""

from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Literal

from hdcal.diagnosis.budget import Budget
from hdcal.diagnosis.gap import Cell, CovariateShare, Gap, Seen
from hdcal.diagnosis.verdict import Closure, NextRun, Which
from hdcal.errors import Finding
from hdcal.inference.model_average import LeftOut
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
from hdcal.report.intervals import Interval
from hdcal.report.posterior_answer import CalibratedGear


def _if(condition: dict, then: dict) -> dict:
    return {"if": {"properties": condition}, "then": {"properties": then}}


def _inside(part: str, rules: dict) -> dict:
    return {part: {"properties": rules}}


@dataclass(frozen=True)
class WhereAnswer:
    """Where the gap lies: `cells` were declared beforehand, `regions` are off."""

    p_value: Probability
    statistics: dict[str, Real]
    shares: tuple[CovariateShare, ...]
    regions: tuple[Cell, ...]
    cells: tuple[Cell, ...]


@dataclass(frozen=True)
class Refit:
    """A corrected model that was calibrated: a group of posterior.nc."""

    hypothesis: Words
    probability: Probability


@dataclass(frozen=True)
class DiagnosedData:
    """Which data they were.

    `averaged_rows` are in each mean that was diagnosed, one mean of `row_step`.
    """

    name: str
    rows: Annotated[int, Promise(minimum=1)]
    averaged_rows: Annotated[int, Promise(minimum=1)]
    row_step: Annotated[int, Promise(minimum=1)]
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
            _inside("which", {"verdict": {"enum": ["named", "group", "ambiguous"]}}),
            _inside("which", {"effect": {"type": "string"}}),
        ),
    )

    schema: Literal["hdcal.verdict/2"] = "hdcal.verdict/2"
    answer: Sentences
    limits: Sentences
    interval: float
    gap: Gap
    seen: tuple[Seen, ...]
    where: WhereAnswer
    which: Which
    shrink: Closure
    next_test: tuple[NextRun, ...]
    next_test_reason: str
    budget: Budget | None
    refits: tuple[Refit, ...]
    left_out: LeftOut | None = None
    stiffness_N_per_mm: Interval | None = None
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
    refused: dict[str, tuple[Finding, ...]] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class RefusedAnswer(Answer):
    """What is wrong with the cases of one call that have no answer; refused.json."""

    schema: Literal["hdcal.refused/1"] = "hdcal.refused/1"
    cases: dict[str, tuple[Finding, ...]]
