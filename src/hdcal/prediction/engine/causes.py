"""The causes that an answer averages over: models, each with its probability."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np

from hdcal.data.regular_file import why_not_readable
from hdcal.data.typed_json import typed
from hdcal.errors import Finding, InputError, NotUsable
from hdcal.inference import laplace
from hdcal.inference.hypotheses import (
    LEFT_OUT,
    NONE,
    ORIGIN,
    UNKNOWN,
    HeldOrigin,
    LeftOut,
)
from hdcal.inference.mixed_posterior import models_of
from hdcal.inference.posterior import Posterior
from hdcal.inference.problem import Problem
from hdcal.inference.values import Values
from hdcal.prediction.engine.models import Models, model_pairs
from hdcal.report.words import hypothesis, percent

VERDICT = "verdict.json"
SCHEMA = "hdcal.verdict/2"
_LARGEST_VERDICT = 64 << 20
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
    """

    probability: float
    posterior: Posterior
    values: Values

    @property
    def problem(self) -> Problem:
        """Structure of the model."""
        return self.posterior.problem

    @cached_property
    def whitening(self) -> laplace.Whitening:
        """Mode of its density and curvature there."""
        held = self.posterior.arrays.groups.get(laplace.GROUP)
        return laplace.from_group(self.problem, held)

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
        models: a posterior, several with the probabilities of their models, or a
            verdict. One that is a mixture counts as the models in it.
        allow_failed: also calibrations that failed their checks.

    Raises:
        NotUsable: a calibration failed its checks.
        InputError: there are none, or they are not of the same data.
    """
    given = model_pairs(models)
    listed = [
        (weight * share, alone)
        for weight, model in given
        for share, alone in models_of(model)
    ]
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
        Cause(share / total, model, model.draws) for share, model in listed if share > 0
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
    missing = left_out(causes[0].posterior)
    return 0.0 if missing is None else missing.probability


def left_out(posterior: Posterior) -> LeftOut | None:
    """Return what a diagnosis calibrated no model of; None where that is nothing."""
    stated = posterior.settings.get(LEFT_OUT)
    return None if stated is None else typed(LeftOut, stated)


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
    first = causes[0].posterior
    origin = first.settings.get(ORIGIN)
    if origin is None:
        return []
    known = typed(HeldOrigin, origin)
    others = len(known.probabilities) - 1
    if len(causes) == 1 and (others or LEFT_OUT not in first.settings):
        name = hypothesis(known.hypothesis or causes[0].name)
        return [
            f"This rests on {name} alone: what else the diagnosis held possible has "
            "no part in it. Name the folder of the diagnosis, or diagnose again."
        ]
    missing = left_out(first)
    if missing is None or missing.probability <= _ROUNDING:
        return []
    return [
        f"{percent(missing.probability)} of the probability lies on hypotheses that "
        f"were not calibrated; it counts as {hypothesis(missing.counted_as)}."
    ]


def read_models(run: Path | str) -> list[tuple[float, Posterior]]:
    """Return the models of a folder of `hdcal calibrate` or `hdcal diagnose`.

    Args:
        run: the folder, or a single posterior file.

    Raises:
        NotUsable: the diagnosis failed.
        InputError: a file is missing, changed or of another version.
    """
    run = Path(run)
    if not (run / VERDICT).is_file():
        return [(1.0, Posterior.load(run))]
    found = _read_verdict(run / VERDICT)
    if found["status"] != "ok":
        reasons = "; ".join(map(str, found.get("reasons", [])))
        raise NotUsable(f"this diagnosis failed and must not be used: {reasons}")
    refits = found.get("refits", [])
    if not refits:
        words = "holds no calibrated model"
        remedy = "Diagnose again with sampling, or calibrate"
        raise InputError([Finding(str(run), words, remedy)])
    loaded, findings = [], []
    for refit in refits:
        try:
            loaded.append(Posterior.load(run / refit["file"]))
        except InputError as error:
            findings += error.findings
    if findings:
        raise InputError(findings)
    return _weighed(run, refits, loaded)


def _read_verdict(path: Path) -> dict:
    """Return a verdict of this version with whole entries for its models."""
    if (why := why_not_readable(path, _LARGEST_VERDICT)) is not None:
        raise InputError([Finding(str(path), *why)])
    words, remedy = "is not a verdict that hdcal wrote", "Diagnose again"
    try:
        found = json.loads(path.read_text("utf-8"))
        schema = str(found["schema"])
        if schema == SCHEMA and _is_whole(found):
            return found
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        schema = SCHEMA
    if schema != SCHEMA:
        words = f"has the format {schema[:60]}, and this hdcal reads {SCHEMA}"
        remedy = "Use the hdcal that wrote it, or diagnose again"
    raise InputError([Finding(str(path), words, remedy)])


def _is_whole(found: dict) -> bool:
    """Tell whether every model has a name, a probability and a file of this folder."""
    refits = found.get("refits", [])
    names = {refit["hypothesis"]: refit["probability"] for refit in refits}
    inside = all(Path(refit["file"]).name == refit["file"] for refit in refits)
    return inside and len(names) == len(refits) and isinstance(found["status"], str)


def _weighed(run: Path, refits, loaded) -> list[tuple[float, Posterior]]:
    """Return the models with what their own files, which are sealed, say of them."""
    told = {refit["hypothesis"]: refit["probability"] for refit in refits}
    for refit, posterior in zip(refits, loaded, strict=True):
        origin = posterior.settings.get(ORIGIN, {})
        if origin != {"hypothesis": refit["hypothesis"], "probabilities": told}:
            words = f"does not belong to {refit['file']}: one of them was changed"
            remedy = "Take the folder as it was written, or diagnose again"
            raise InputError([Finding(str(run / VERDICT), words, remedy)])
    return list(zip(told.values(), loaded, strict=True))
