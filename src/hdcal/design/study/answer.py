"""The JSON answer of a study."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

from hdcal.design.answer import DesignAnswer
from hdcal.report.answer import Promise

_COLUMNS = ["material", "force_median_N", "force_lo_N", "force_hi_N", "stress_MPa"]


@dataclass(frozen=True, kw_only=True)
class StudyAnswer(DesignAnswer):
    """What `hdcal study` answers; study.json.

    Attributes:
        varied: names of the columns that were varied.
        columns: of study.csv by name.
    """

    schema: Literal["hdcal.study/1"] = "hdcal.study/1"
    varied: tuple[str, ...]
    columns: Annotated[
        Mapping[str, tuple[float | str, ...]], Promise(required=_COLUMNS)
    ]
