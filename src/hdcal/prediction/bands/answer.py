"""The JSON answer of `hdcal predict`: the table by column."""

from dataclasses import dataclass
from typing import Annotated, Literal

from hdcal.prediction.bands.bands import COLUMNS
from hdcal.report.answer import Answer, Probability, Promise, Real


@dataclass(frozen=True, kw_only=True)
class PredictionAnswer(Answer):
    """What `hdcal predict` answers.

    Attributes:
        interval: probability inside the bands.
        causes: probability of each hypothesis that was averaged over.
        weight_left_out: of it, what lay on hypotheses without a model of their own.
        columns: those of bands.csv by name; what was not fitted is null.
    """

    schema: Literal["hdcal.prediction/1"] = "hdcal.prediction/1"
    status: Literal["ok"] = "ok"
    interval: Annotated[float, Promise(exclusiveMinimum=0, exclusiveMaximum=1)]
    causes: dict[str, Probability]
    weight_left_out: Probability
    columns: Annotated[
        dict[str, tuple[Real | bool | str, ...]], Promise(required=[*COLUMNS])
    ]
