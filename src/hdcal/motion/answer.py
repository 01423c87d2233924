"""The JSON answer of a dynamic calibration: what each number in it is."""

from dataclasses import dataclass
from typing import Annotated, Literal

from hdcal.report.answer import Probability, Promise, Sentences
from hdcal.report.intervals import Interval
from hdcal.report.parameters import ParameterEstimate
from hdcal.report.posterior_answer import PARAMETER_NAMES, PosteriorAnswer

_ALWAYS = ["K", "E0", "alpha", "mass", "damping_ratio", "deformation_offset"]
_ALWAYS += ["initial_deformation", "initial_velocity", "deformation_sigma"]


@dataclass(frozen=True)
class Loss:
    """What takes the energy of a swing.

    Attributes:
        name: of a model with a probability of 0.9 or more, or of the linear model that
            leaves noise where dry friction would show; None where no model leaves only
            noise, and where nobody looked.
        probabilities: of each model, the same before the data; empty without.
        dry_share: of the energy that the largest swing loses, what dry friction takes;
            None without friction in the model.
    """

    name: Literal["viscous", "dry friction", "both", "cannot tell"] | None
    probabilities: dict[str, Probability]
    dry_share: Interval | None


@dataclass(frozen=True, kw_only=True)
class DynamicCalibrationAnswer(PosteriorAnswer):
    """What `hdcal calibrate --dynamic` answers; summary.json.

    Attributes:
        damping_N_s_per_mm: c, at the temperature of the test, as all below.
        damping_ratio: ζ.
        natural_frequency_Hz: without damping.
        damped_frequency_Hz: with it.
        loss: what takes the energy of a swing.
        assumptions: what the model takes for granted, in sentences.
    """

    schema: Literal["hdcal.dynamic-calibration/1"] = "hdcal.dynamic-calibration/1"
    parameters: Annotated[
        dict[str, ParameterEstimate],
        Promise(required=_ALWAYS, propertyNames=PARAMETER_NAMES),
    ]
    damping_N_s_per_mm: Interval
    damping_ratio: Interval
    natural_frequency_Hz: Interval
    damped_frequency_Hz: Interval
    loss: Loss
    assumptions: Sentences
