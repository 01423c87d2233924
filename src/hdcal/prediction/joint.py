"""Draws of several models of one case as those of one model, which answers all.

The joint model has the effects of all models. An effect that a model lacks has its null
value in the draws of that model, and each model has as many draws as it is probable.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from hdcal.data.prior import REFERENCE
from hdcal.data.priors import effect_priors
from hdcal.inference.distributions import moments
from hdcal.inference.force_model.priors import without_scatter
from hdcal.inference.force_model.problem import Problem, build_problem
from hdcal.inference.force_model.serial_correlation import CORRELATION
from hdcal.inference.posterior import Posterior
from hdcal.physics.effect import Effect, parameters
from hdcal.prediction.models import Model, Models, models_of

# Sites of models with a discrepancy and with correlated noise, null elsewhere.
_AT_ZERO = ("gap_sd", "gap_weights", CORRELATION)
# Drifts of the rig with temperature, by the effect whose prior states them.
DRIFTS = {"zero_drift": "thermal_zero_drift", "frame_drift": "thermal_expansion"}


@dataclass(frozen=True)
class JointModel:
    """Models of one case, the most probable first, as one with all their effects.

    Of each model some rows of its draws are taken.
    """

    models: tuple[Model, ...]
    rows: tuple[np.ndarray, ...]

    @property
    def posterior(self) -> Posterior:
        """That of the most probable model."""
        return self.models[0].posterior

    @property
    def effects(self) -> tuple[type[Effect], ...]:
        """Effects of all models, by name."""
        if len(self.models) == 1:
            return self.posterior.effects
        named = {e.name: e for m in self.models for e in m.posterior.effects}
        return tuple(named[name] for name in sorted(named))

    @cached_property
    def problem(self) -> Problem:
        """Structure with the effects of all models."""
        if len(self.models) == 1:
            return self.posterior.problem
        structures = [model.posterior.structure for model in self.models]
        with_gap = any(structure.with_gap for structure in structures)
        priors = {
            name: prior
            for model in reversed(self.models)
            for name, prior in model.posterior.priors.items()
        }
        return build_problem(
            self.posterior.case,
            priors,
            self.effects,
            theory=self.posterior.theory,
            structure=replace(structures[0], with_gap=with_gap),
        )

    @property
    def size(self) -> int:
        """Number of draws."""
        return sum(map(len, self.rows))

    @property
    def number(self) -> np.ndarray:
        """Number of the model of each draw, (draw,)."""
        return np.repeat(np.arange(len(self.rows)), [len(rows) for rows in self.rows])

    @cached_property
    def draws(self) -> dict[str, np.ndarray]:
        """Parameters by site, model after model, without those of tested members."""
        nulls = dict.fromkeys(_AT_ZERO, 0.0) | {
            f"{effect.name}.{name}": spec.null
            for effect in without_scatter(self.effects)
            for name, spec in parameters(effect).items()
            if spec.null is not None
        }
        sites = dict.fromkeys(name for model in self.models for name in model.draws)
        return {name: self._joined(name, nulls) for name in sites}

    def _joined(self, site: str, nulls: dict[str, float]) -> np.ndarray:
        """Return the draws of a site; of a model without it at its null.

        The shape of an effect that a model lacks does not matter.
        """
        first = next(m.draws[site] for m in self.models if site in m.draws)
        parts = []
        for model, rows in zip(self.models, self.rows, strict=True):
            if site in model.draws:
                parts.append(model.draws[site][rows])
            elif site in nulls:
                parts.append(np.full((len(rows), *first.shape[1:]), nulls[site]))
            else:
                parts.append(np.resize(first, (len(rows), *first.shape[1:])))
        return np.concatenate(parts)

    def bend(self, place: np.ndarray, level: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return mean and sd of the bend of each draw by its model [N], (draw, row).

        The place is the deformation as read [mm], (row,); the level, (draw,), selects a
        law of the bend by its probability.
        """
        ends = np.cumsum([len(rows) for rows in self.rows])[:-1]
        parts = [
            model.bend(place, part)
            for model, part in zip(self.models, np.split(level, ends), strict=True)
        ]
        return tuple(map(np.concatenate, zip(*parts, strict=True)))

    @cached_property
    def drifts(self) -> dict[str, np.ndarray]:
        """Mean and sd of DRIFTS [N/K, mm/K] of each draw, (2, draw) each.

        By the priors of their effects, and none where a model has that effect.
        """
        case = self.posterior.case
        # A frame expands by its own length, however short the stroke.
        stroke = max(case.gear.full_scale.deformation, REFERENCE.deformation)
        priors = effect_priors(replace(case.gear.full_scale, deformation=stroke))
        priors |= case.gear.effect_priors
        drifts = {}
        for name, effect in DRIFTS.items():
            lacking = np.array([effect not in model.effects for model in self.models])
            law = np.array(moments(priors[f"{effect}.slope"]))
            drifts[name] = law[:, None] * lacking[self.number]
        return drifts

    @property
    def independent_draws(self) -> float:
        """Effective number of draws of all models."""
        least = sum(m.probability**2 / m.independent_draws for m in self.models)
        total = sum(model.probability for model in self.models)
        return min(total**2 / least, self.size)

    def driver(self, site: str) -> Literal["data", "prior"]:
        """Return whether the data or the prior determine a parameter."""
        diagnosis = self.posterior.diagnoses.get(site)
        return "prior" if diagnosis is None else diagnosis.driven_by

    def take(self, places: np.ndarray) -> "JointModel":
        """Return some of the draws, by ascending places."""
        number, rows = self.number[places], np.concatenate(self.rows)[places]
        parts = tuple(rows[number == model] for model in range(len(self.models)))
        return replace(self, rows=parts)


def joint(
    models: Models, most: int | None = None, *, allow_failed: bool = False
) -> JointModel:
    """Return models as one, with at most so many draws; see `models_of` for errors."""
    return join(models_of(models, allow_failed=allow_failed), most)


def join(models: Sequence[Model], most: int | None = None) -> JointModel:
    """Return models as one; draws are taken evenly, probabilities may have any sum."""
    total = sum(model.probability for model in models)
    whole = min(model.size * total / model.probability for model in models)
    size = min(whole, most or np.inf)
    rows = []
    for model in models:
        count = max(round(size * model.probability / total), 1)
        places = np.linspace(0, model.size - 1, min(count, model.size))
        rows.append(places.round().astype(int))
    return JointModel(tuple(models), tuple(rows))
