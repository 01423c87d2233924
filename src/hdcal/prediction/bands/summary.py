"""Bands as an answer."""

from hdcal.prediction.bands.answer import PredictionAnswer
from hdcal.prediction.bands.bands import Bands
from hdcal.prediction.bands.document import headline, next_step


def prediction_answer(bands: Bands, interval: float = 0.95) -> PredictionAnswer:
    """Return bands as an answer, ready for JSON.

    Args:
        bands: from `predict`.
        interval: probability inside them.
    """
    return PredictionAnswer(
        reasons=(),
        headline=headline(bands, interval),
        next_step=next_step(bands),
        interval=interval,
        columns={name: tuple(c.tolist()) for name, c in bands.columns().items()},
    )
