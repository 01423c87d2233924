"""Calibrated models with their probabilities, over which an answer averages."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from hdcal.errors import Finding, InputError
from hdcal.inference.model_average import NONE, UNKNOWN, LeftOut
from hdcal.inference.posterior import Posterior
from hdcal.prediction.extrapolation import Bend, fit_bends
from hdcal.report.words import hypothesis, percent

# Sites of the tested members: a future member has none of these values.
TESTED = ("run_offset", "specimen_deviation")
# A smaller probability is the rounding error of a sum.
_ROUNDING = 1e-6


class Averaged(Protocol):
    """A diagnosis, or another average of calibrated models."""

    @property
    def posteriors(self) -> Mapping[str, tuple[float, Posterior]]:
        """Models by hypothesis, each with its probability."""
        ...


Models = Posterior | Averaged | Sequence[tuple[float, Posterior]]


@dataclass(frozen=True)
class Model:
    """A calibrated model and its probability among all models of an answer."""

    probability: float
    posterior: Posterior

    @property
    def effects(self) -> list[str]:
        """Names of the effects, in order."""
        return sorted(effect.name for effect in self.posterior.effects)

    @cached_property
    def draws(self) -> dict[str, np.ndarray]:
        """Parameters by site in code units, without those of tested members."""
        held = self.posterior.draws.items()
        return {name: values for name, values in held if name not in TESTED}

    @property
    def size(self) -> int:
        """Number of draws."""
        return len(self.draws["K"])

    @property
    def name(self) -> str:
        """Name among the hypotheses of a diagnosis."""
        rest = [] if self.posterior.problem.discrepancy is None else [UNKNOWN]
        return "+".join([*self.effects, *rest]) or NONE

    @cached_property
    def bends(self) -> tuple[Bend, Bend]:
        """Bends that the readings leave possible, below and above their range."""
        return fit_bends(self.posterior)

    def bend(self, place: np.ndarray, level: np.ndarray):
        """Return mean and sd of the bend of each draw [N], (draw, row) each.

        As `JointModel.bend`. Inside the tested range both bends describe the same
        residuals, each best near its end. A fitted discrepancy covers that range: then
        the bend acts beyond it.
        """
        below, above = self.bends
        upper = np.clip(above.place(place), 0.0, 1.0)
        acting = 1.0
        if self.posterior.problem.discrepancy is not None:
            acting = self.beyond(place)
        ends = above.of_draws(place, level), below.of_draws(place, level)
        return tuple(
            acting * (upper * high + (1.0 - upper) * low)
            for high, low in zip(*ends, strict=True)
        )

    def beyond(self, place: np.ndarray) -> np.ndarray:
        """Return the share of a fitted discrepancy that the bend replaces, (row,)."""
        below, above = self.bends
        return np.maximum(above.beyond(place), below.beyond(place))

    @property
    def independent_draws(self) -> float:
        """Effective number of draws in the tails of the parameters."""
        sizes = [diagnosis.ess_tail for diagnosis in self.posterior.diagnoses.values()]
        return min([self.size, *(size for size in sizes if np.isfinite(size))])


def model_pairs(models: Models) -> Sequence[tuple[float, Posterior]]:
    """Return models with their probabilities, or refuse what is none."""
    if isinstance(models, Posterior):
        return [(1.0, models)]
    if isinstance(models, list | tuple):
        if all(isinstance(pair, list | tuple) and len(pair) == 2 for pair in models):
            return models
        words, remedy = "are not pairs", "Give [(0.6, posterior), (0.4, other)]"
        raise InputError([Finding("models", words, remedy)])
    if held := getattr(models, "posteriors", None):
        return list(held.values())
    words = f"{type(models).__name__} is not a calibrated model; a quick diagnosis "
    words += "contains none"
    remedy = "Give a calibration, or a diagnosis without `quick`"
    # A fleet, or its posterior.
    if hasattr(models, "margin"):
        remedy = "Use its method `margin`"
    raise InputError([Finding("models", words, remedy)])


def models_of(models: Models, *, allow_failed: bool = False) -> tuple[Model, ...]:
    """Return models, the most probable first, with probabilities that sum to 1.

    Models that failed their checks are an error unless allowed.

    Raises:
        NotUsable: a calibration failed its checks.
        InputError: there are none, or they are not of the same data.
    """
    pairs = model_pairs(models)
    total = sum(share for share, _ in pairs)
    if not total > 0.0 or any(share < 0.0 for share, _ in pairs):
        words, remedy = "have no probability", "Give (probability, posterior) pairs"
        raise InputError([Finding("models", words, remedy)])
    if len({posterior.case.data_sha256 for _, posterior in pairs}) > 1:
        words, remedy = "are of different data", "Give models of the same data"
        raise InputError([Finding("models", words, remedy)])
    if not allow_failed:
        for _, posterior in pairs:
            posterior.require_usable()
    kept = [Model(share / total, each) for share, each in pairs if share > 0.0]
    return tuple(sorted(kept, key=lambda model: -model.probability))


def probabilities(models: Sequence[Model]) -> dict[str, float]:
    """Return the probability of each hypothesis, the most probable first."""
    total: dict[str, float] = {}
    for model in models:
        total[model.name] = total.get(model.name, 0.0) + model.probability
    return dict(sorted(total.items(), key=lambda item: -item[1]))


def left_out_of(models: Models) -> float:
    """Return the probability of hypotheses that a diagnosis did not calibrate."""
    missing: LeftOut | None = getattr(models, "left_out", None)
    return 0.0 if missing is None else missing.probability


def averaging_words(models: Models) -> list[str]:
    """Return sentences on the hypotheses of an average and on those left out."""
    every, sentences = models_of(models, allow_failed=True), []
    if len(every) > 1:
        shares = probabilities(every).items()
        listed = ", ".join(f"{hypothesis(n)} ({percent(p)})" for n, p in shares)
        sentences.append(
            f"The result is an average over the possible causes: {listed}."
        )
    missing: LeftOut | None = getattr(models, "left_out", None)
    if missing is not None and missing.probability > _ROUNDING:
        words = f"{percent(missing.probability)} of the probability belongs to "
        words += "hypotheses that were not calibrated; it is assigned to "
        sentences.append(f"{words}{hypothesis(missing.counted_as)}.")
    return sentences


def joint_draws(models: Sequence[Model], site: str, count: int = 4000) -> np.ndarray:
    """Return draws of a parameter over all models, (count,), each by its weight."""
    values = np.concatenate([model.draws[site] for model in models])
    weights = [np.full(model.size, model.probability / model.size) for model in models]
    ends = np.cumsum(np.concatenate(weights))
    return values[np.searchsorted(ends / ends[-1], (np.arange(count) + 0.5) / count)]
