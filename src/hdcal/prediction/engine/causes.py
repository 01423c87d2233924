"""The causes that an answer averages over: models, each with its probability."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from hdcal.errors import Finding, InputError
from hdcal.inference import laplace
from hdcal.inference.model_average import NONE, UNKNOWN, LeftOut
from hdcal.inference.posterior import Posterior
from hdcal.inference.problem import Problem
from hdcal.inference.values import Values
from hdcal.prediction.engine.models import Models, model_pairs
from hdcal.report.words import hypothesis, percent

# Of probability that is left out, less than this is the rounding of a sum.
_ROUNDING = 1e-6
# What an uncertainty comes from.
Driver = Literal["data", "prior", "given"]


@dataclass(frozen=True)
class Cause:
    """One model of what was measured.

    Attributes:
        probability: of the model; those of all causes sum to 1.
        posterior: from `calibrate`.
        values: its draws by site, in code units: [draw, …].
        left_out: what the diagnosis that it is of calibrated no model of.
    """

    probability: float
    posterior: Posterior
    values: Values
    left_out: LeftOut | None = None

    @property
    def problem(self) -> Problem:
        """Structure of the model."""
        return self.posterior.problem

    @cached_property
    def whitening(self) -> laplace.Whitening:
        """Mode of its density and curvature there."""
        return laplace.fit(self.problem)

    @property
    def size(self) -> int:
        """Number of draws."""
        return len(self.values["K"])

    @property
    def weights(self) -> np.ndarray:
        """Weight of each draw among those of all causes."""
        return np.full(self.size, self.probability / self.size)

    @property
    def name(self) -> str:
        """What the model is called among the hypotheses of a diagnosis."""
        effects = "+".join(sorted(effect.name for effect in self.posterior.effects))
        rest = UNKNOWN if self.problem.discrepancy is not None else ""
        return "+".join(filter(None, (effects, rest))) or NONE

    def driver(self, name: str) -> Driver:
        """Return whether data or prior determine a parameter."""
        found = self.posterior.diagnoses.get(name)
        return "data" if found is not None and found.driven_by == "data" else "prior"


def independent_draws(cause: Cause) -> float:
    """Return how many independent draws those of a cause are worth in the tails."""
    worth = [d.ess_tail for d in cause.posterior.diagnoses.values()]
    return min([cause.size, *(size for size in worth if np.isfinite(size))])


def jointly_worth(causes: Sequence[Cause]) -> float:
    """Return how many independent draws of one law those of all causes are worth."""
    return 1.0 / sum(c.probability**2 / independent_draws(c) for c in causes)


def causes_of(models: Models, *, allow_failed: bool = False) -> tuple[Cause, ...]:
    """Return models as causes whose probabilities sum to 1.

    Args:
        models: a posterior, several with the probabilities of their models, a model
            average, or a diagnosis.
        allow_failed: also calibrations that failed their checks.

    Raises:
        NotUsable: a calibration failed its checks.
        InputError: there are none, or they are not of the same data.
    """
    listed, left_out = model_pairs(models), getattr(models, "left_out", None)
    total = sum(share for share, _ in listed)
    cases = {model.case.data_sha256 for _, model in listed}
    if not listed or not total > 0.0 or any(share < 0.0 for share, _ in listed):
        words, remedy = "hold no probability", "Give (probability, posterior) pairs"
        raise InputError([Finding("models", words, remedy)])
    if len(cases) > 1:
        words, remedy = "are not of the same data", "Give models of one case"
        raise InputError([Finding("models", words, remedy)])
    for _, model in listed if not allow_failed else ():
        model.require_usable()
    return tuple(
        Cause(share / total, model, model.draws, left_out)
        for share, model in listed
        if share > 0.0
    )


def likeliest(causes: Sequence[Cause]) -> Cause:
    """Return the cause of the highest probability."""
    return max(causes, key=lambda cause: cause.probability)


def chances_of(causes: Sequence[Cause]) -> dict[str, float]:
    """Return the probability of each hypothesis, the most probable first."""
    found = dict.fromkeys((cause.name for cause in causes), 0.0)
    for cause in causes:
        found[cause.name] += cause.probability
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def weight_left_out(causes: Sequence[Cause]) -> float:
    """Return the probability of what has no model of its own among the causes."""
    missing = causes[0].left_out
    return 0.0 if missing is None else missing.probability


def averaging_words(causes: Sequence[Cause]) -> list[str]:
    """Say over which hypotheses an answer averages, and what was left out."""
    told = []
    if len(causes) > 1:
        listed = ", ".join(
            f"{hypothesis(name)} ({percent(share)})"
            for name, share in chances_of(causes).items()
        )
        told.append(f"This averages over the causes that are left: {listed}.")
    return told + left_out_words(causes)


def left_out_words(causes: Sequence[Cause]) -> list[str]:
    """Say what part of a diagnosis has no model of its own in an answer."""
    missing = causes[0].left_out
    if missing is None or missing.probability <= _ROUNDING:
        return []
    return [
        f"{percent(missing.probability)} of the probability lies on hypotheses that "
        f"were not calibrated; it counts as {hypothesis(missing.counted_as)}."
    ]
