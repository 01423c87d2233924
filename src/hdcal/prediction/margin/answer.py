"""The JSON answer of a margin: its numbers, and how they were come by."""

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from hdcal.prediction.margin.result import INTERVAL, Margin
from hdcal.report.answer import Answer, Count, Digest, Promise, Sentences, Words
from hdcal.report.posterior_answer import CalibratedGear

# A bound of that name is one of a population of gears.
_BASIS_RULE = {
    "if": {"properties": {"basis": {"pattern": "^[AB]"}}},
    "then": {"properties": {"population": {"const": "specimens"}}},
}


@dataclass(frozen=True)
class DataUsed:
    """Which data a calibration is of."""

    name: str
    rows: Count
    sha256: Digest


@dataclass(frozen=True, kw_only=True)
class MarginAnswer(Margin, Answer):
    """What `hdcal margin` answers; margin.json.

    Attributes:
        answer: the answer in sentences.
        shares_note: what the shares of the variance are.
        interval: probability inside the intervals.
        kinds: of interval, by the name of the number.
        seed: it was made with.
        versions: of hdcal and what it rests on, by name.
        gear: which one it is.
        data: of the calibration.
    """

    RULES: ClassVar[tuple[dict, ...]] = (*Answer.RULES, _BASIS_RULE)

    schema: Literal["hdcal.margin/2"] = "hdcal.margin/2"
    status: Literal["ok"] = "ok"
    answer: Sentences
    shares_note: Words
    interval: Annotated[float, Promise(const=INTERVAL)] = INTERVAL
    kinds: dict[str, str]
    seed: Count
    versions: Annotated[dict[str, str], Promise(required=["hdcal"])]
    gear: CalibratedGear
    data: DataUsed
