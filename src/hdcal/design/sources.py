"""The source of a design: a calibration, or a gear with its priors."""

from pathlib import Path

from hdcal.data.case import Gear
from hdcal.data.gear import read_gear
from hdcal.errors import Finding, Findings
from hdcal.inference.model_average import ModelAverage, load_models
from hdcal.inference.posterior import Posterior


def open_source(
    wrong: Findings, run: str | None, gear: str | None, kind: str
) -> tuple[Posterior | ModelAverage | Gear | None, str | None]:
    """Return the calibration or gear, and the default folder of the result.

    Args:
        wrong: collects the findings; nothing is raised.
        run: folder of a calibration.
        gear: a gear file, instead of it.
        kind: ending of the folder's name.

    Returns:
        Both are None if something is wrong.
    """
    if (run is None) == (gear is None):
        words = "is missing" if run is None else "and `gear` are given both"
        remedy = "Name a folder of hdcal calibrate, or `gear` GEAR.toml for priors only"
        wrong.append(Finding("run", words, remedy))
        return None, None
    if gear is not None:
        return wrong.attempt(read_gear, gear), f"{Path(gear).stem}-{kind}"
    assert run is not None
    models = wrong.attempt(load_models, run)
    return models, None if models is None else f"{models.case.name}-{kind}"
