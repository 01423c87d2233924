"""What a command starts from: the result of an earlier one."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hdcal.inference.model_average import ModelAverage
    from hdcal.inference.posterior import Posterior


def load_usable(run: str) -> "Posterior | ModelAverage":
    """Load the calibration or the models of a diagnosis in a result folder.

    Raises:
        InputError: there is none, or it was changed.
        NotUsable: it failed its checks.
    """
    from hdcal.inference.model_average import load_models

    models = load_models(run)
    models.require_usable()
    return models
