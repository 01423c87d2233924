"""Bands as an answer."""

from collections.abc import Sequence

from hdcal.prediction.bands.answer import PredictionAnswer
from hdcal.prediction.bands.bands import Bands
from hdcal.prediction.bands.document import headline, next_step
from hdcal.prediction.engine.causes import Cause, chances_of, weight_left_out


def prediction_answer(
    bands: Bands, interval: float = 0.95, causes: Sequence[Cause] = ()
) -> PredictionAnswer:
    """Return bands as an answer, ready for JSON.

    Args:
        bands: from `predict`.
        interval: probability inside them.
        causes: that they average over.
    """
    return PredictionAnswer(
        units=bands.units,
        reasons=(),
        headline=headline(bands, interval),
        next_step=next_step(bands),
        interval=interval,
        causes=chances_of(causes),
        weight_left_out=weight_left_out(causes) if causes else 0.0,
        columns={name: tuple(c.tolist()) for name, c in bands.columns().items()},
    )
