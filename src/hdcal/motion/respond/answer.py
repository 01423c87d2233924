"""The JSON answer of a response: what each number in it is."""

from dataclasses import dataclass
from typing import Annotated, Literal

from hdcal.motion.quantities import QUANTITIES
from hdcal.report.answer import Answer, Promise, Sentences
from hdcal.report.intervals import Interval

COLUMNS = ["time_s", "force_N", "deformation_lo_mm", "deformation_median_mm"]
COLUMNS += ["deformation_hi_mm", "tested"]
_OneOrMore = Annotated[int, Promise(minimum=1)]


@dataclass(frozen=True)
class QuantityEstimate(Interval):
    """A quantity, and who decided it."""

    driven_by: Literal["data", "prior", "given"]


@dataclass(frozen=True, kw_only=True)
class ResponseAnswer(Answer):
    """What `hdcal respond` answers; response.json.

    Attributes:
        gear: its name.
        calibration: whether the gear was calibrated moving or at rest.
        force: on the gear, in words.
        temperature_C: of the gear.
        estimates: by quantity.
        interval: probability that every interval holds.
        interval_kind: what kind of interval the band is.
        tested_share: share of the times within what was calibrated.
        effects: of the calibration, taken along.
        left_out: those that were not.
        remarks: what the reader must know, in sentences.
        draws: gears integrated.
        points: times answered at.
    """

    schema: Literal["hdcal.response/1"] = "hdcal.response/1"
    gear: str
    calibration: Literal["moving", "at rest"]
    force: str
    temperature_C: float
    estimates: Annotated[
        dict[str, QuantityEstimate], Promise(required=list(QUANTITIES))
    ]
    interval: float
    interval_kind: str
    tested_share: Annotated[float, Promise(minimum=0, maximum=1)]
    effects: tuple[str, ...]
    left_out: tuple[str, ...]
    remarks: Sentences
    draws: _OneOrMore
    points: _OneOrMore


@dataclass(frozen=True, kw_only=True)
class ResponseWithColumns(ResponseAnswer):
    """What `hdcal respond --json` prints: the rows of response.csv too."""

    columns: Annotated[dict[str, list[float | bool]], Promise(required=COLUMNS)]
