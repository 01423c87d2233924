"""Draws of several models as those of one, for what needs one structure.

The joint model has the effects of all models. An effect that a model lacks has its null
value in the draws of that model, and each model has as many draws as it is probable.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from hdcal.inference.force_model.priors import without_scatter
from hdcal.inference.force_model.problem import Problem, build_problem
from hdcal.inference.force_model.serial_correlation import CORRELATION
from hdcal.physics.effect import Effect, parameters
from hdcal.prediction.models import Model, Models, models_of

# Sites of models with a leftover discrepancy and with correlated noise, null elsewhere.
_AT_ZERO = ("gap_sd", "gap_weights", CORRELATION)


@dataclass(frozen=True)
class JointModel(Model):
    """Models of one case as one model with all their effects.

    Attributes:
        models: the most probable first; its posterior has case and theory.
        rows: of each model the draws that are taken.
    """

    models: tuple[Model, ...]
    rows: tuple[np.ndarray, ...]

    @property
    def effects(self) -> tuple[type[Effect], ...]:
        """Effects of all models, by name."""
        named = {e.name: e for model in self.models for e in model.effects}
        return tuple(named[name] for name in sorted(named))

    @cached_property
    def problem(self) -> Problem:
        """Structure with the effects of all models."""
        if len(self.models) == 1:
            return self.posterior.problem
        structures = [model.posterior.structure for model in self.models]
        with_gap = any(one.with_gap for one in structures)
        priors = {
            name: prior
            for model in reversed(self.models)
            for name, prior in model.posterior.priors.items()
        }
        structure = replace(structures[0], with_gap=with_gap)
        case, theory = self.posterior.case, self.posterior.theory
        given = {"theory": theory, "structure": structure}
        return build_problem(case, priors, self.effects, **given)

    @cached_property
    def draws(self) -> dict[str, np.ndarray]:
        """Parameters by site, model after model."""
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

        The shape of an effect that a model lacks does not matter, so that it has the
        values of a model with it.
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

    def bend(self, place: np.ndarray, level: np.ndarray):
        """Return mean and sd of the bend of each draw by its model [N]."""
        ends = np.cumsum([len(rows) for rows in self.rows])[:-1]
        parts = [
            model.bend(place, part)
            for model, part in zip(self.models, np.split(level, ends), strict=True)
        ]
        return tuple(np.concatenate(each) for each in zip(*parts, strict=True))

    @property
    def independent_draws(self) -> float:
        """Effective number of draws of all models."""
        least = sum(m.probability**2 / m.independent_draws for m in self.models)
        total = sum(model.probability for model in self.models)
        return min(total**2 / least, self.size)


def joint(models: Models, most: int | None = None) -> JointModel:
    """Return models as one.

    Args:
        models: as in `models_of`.
        most: draws to take, evenly from every chain; all by default.

    Raises:
        NotUsable: a calibration failed its checks.
        InputError: there are none, or they are not of the same data.
    """
    return join(models_of(models), most)


def join(models: Sequence[Model], most: int | None = None) -> JointModel:
    """Return models as one; their probabilities may have any sum."""
    total = sum(model.probability for model in models)
    whole = min(model.size * total / model.probability for model in models)
    size = min(whole, most or np.inf)
    rows = []
    for model in models:
        count = max(round(size * model.probability / total), 1)
        places = np.linspace(0, model.size - 1, min(count, model.size))
        rows.append(places.round().astype(int))
    return JointModel(1.0, models[0].posterior, tuple(models), tuple(rows))
