"""The JSON answer of a calibration: what each number in it is."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal, get_args

from hdcal.data.theory_names import SPRING, Theory
from hdcal.report.answer import Promise, Sentences, Words
from hdcal.report.parameters import Interval, ParameterEstimate
from hdcal.report.posterior_answer import PARAMETER_NAMES, PosteriorAnswer

_ALWAYS = ["K", "E0", "alpha", "force_offset", "deformation_offset", "sigma"]
_SIZED = [name for name in get_args(Theory) if name != SPRING]


@dataclass(frozen=True)
class ResidualShape:
    """A shape that the residuals have and noise would rarely show.

    Attributes:
        name: what they depend on.
        p_value: adjusted for the number of shapes tried.
        size_N: root mean square of the shape.
        words: one sentence.
    """

    name: str
    p_value: Annotated[float, Promise(minimum=0, maximum=1)]
    size_N: Annotated[float, Promise(minimum=0)]
    words: Words


@dataclass(frozen=True)
class LocalStiffness:
    """The slope of a parabola through the readings, by least squares, at one place."""

    deformation_mm: float
    stiffness_N_per_mm: float


@dataclass(frozen=True, kw_only=True)
class CalibrationAnswer(PosteriorAnswer):
    """What `hdcal calibrate` answers; summary.json.

    Attributes:
        K_by_theory: the one posterior seen through every formula; None of a spring.
        K_note: what to think of K under `article`.
        residuals: shapes found in them.
        next_steps: what would make the answer better, most urgent first.
        effects: in the model.
        with_gap: whether the model has a leftover discrepancy.
        bend: where the residuals of a straight line bend, its slope at both ends.
        beside_a_loop: stiffness as read, 95 % interval [N/mm], of a model with a loop
            of any shape beside the straight line, where loading and unloading differ
            and the calibrated model has no more than the line; flat priors.
        specimens: of several, by label, the stiffness of each as read, 95 % credible
            interval [N/mm].
    """

    schema: Literal["hdcal.calibration/1"] = "hdcal.calibration/1"
    parameters: Annotated[
        dict[str, ParameterEstimate],
        Promise(required=_ALWAYS, propertyNames=PARAMETER_NAMES),
    ]
    K_by_theory: Annotated[Mapping[str, Interval | None], Promise(required=_SIZED)]
    K_note: str
    residuals: tuple[ResidualShape, ...]
    next_steps: Sentences
    effects: tuple[str, ...]
    with_gap: bool
    bend: tuple[LocalStiffness, ...] = ()
    beside_a_loop: Interval | None = None
    specimens: Mapping[str, Interval] = field(default_factory=dict)
