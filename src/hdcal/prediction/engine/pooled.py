"""Several causes as draws of one model, for what maps one program over all draws.

The model holds the effects of every cause. An effect that a cause lacks has its null
value in the draws of that cause, and the draws of each cause are as many as it is
probable.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from hdcal.data.case import Case
from hdcal.data.prior import Prior
from hdcal.data.theory_names import Theory
from hdcal.inference.posterior_tree import group_of
from hdcal.inference.problem import Problem, build_problem, without_scatter
from hdcal.inference.serial_correlation import CORRELATION
from hdcal.inference.values import Values
from hdcal.physics.effect import Effect, parameters
from hdcal.prediction.engine.causes import Cause, causes_of
from hdcal.prediction.engine.models import Models

# Sites of models with a leftover discrepancy and with correlated noise.
_AT_ZERO = ("gap_sd", "gap_weights", CORRELATION)


@dataclass(frozen=True)
class Pooled:
    """Draws of all causes.

    Attributes:
        causes: the most probable first.
        effects: of all causes.
        priors: of the sites of all causes.
        values: draws by site, in code units: [draw, …], chain after chain.
        index: place of the cause of each draw, shape (draw,).
    """

    causes: tuple[Cause, ...]
    effects: tuple[type[Effect], ...]
    priors: dict[str, Prior]
    values: Values
    index: np.ndarray

    @property
    def case(self) -> Case:
        """Data and gear."""
        return self.causes[0].posterior.case

    @property
    def theory(self) -> Theory:
        """Which stiffness K multiplies."""
        return self.causes[0].posterior.theory

    @property
    def moving(self) -> bool:
        """Whether the gear was calibrated in motion."""
        return self.causes[0].posterior.kind == "dynamic"

    @property
    def with_gap(self) -> bool:
        """Whether a cause has a leftover discrepancy."""
        return any(one.posterior.settings["with_gap"] for one in self.causes)

    @cached_property
    def problem(self) -> Problem:
        """Structure of the model that holds all effects."""
        if len(self.causes) == 1:
            return self.causes[0].problem
        posterior = self.causes[0].posterior
        return build_problem(
            self.case,
            self.priors,
            self.effects,
            theory=posterior.theory,
            structure=replace(posterior.structure, with_gap=self.with_gap),
        )


def pool(models: Models) -> Pooled:
    """Return all causes as draws of one model.

    Args:
        models: as `causes_of`.

    Raises:
        NotUsable, InputError: as `causes_of`.
    """
    return pool_causes(causes_of(models))


def pool_causes(causes: Sequence[Cause]) -> Pooled:
    """Return causes as draws of one model; their probabilities may have any sum."""
    causes = tuple(sorted(causes, key=lambda cause: -cause.probability))
    posteriors = [cause.posterior for cause in causes]
    priors = {n: p for one in reversed(posteriors) for n, p in one.priors.items()}
    if len(causes) == 1:
        (alone,) = posteriors
        index = np.zeros(causes[0].size, int)
        return Pooled(causes, alone.effects, priors, alone.draws, index)
    named = {effect.name: effect for one in posteriors for effect in one.effects}
    effects = tuple(named[name] for name in sorted(named))
    rows = _rows(causes)
    index = np.repeat(np.arange(len(causes)), list(map(len, rows)))
    sites = dict.fromkeys(name for one in posteriors for name in one.draws)
    values = {name: _values(name, causes, rows, effects) for name in sites}
    chains = posteriors[0].size[0]
    return Pooled(causes, effects, priors, values, np.tile(index, chains))


def _rows(causes: Sequence[Cause]) -> list[np.ndarray]:
    """Return which draws of each chain every cause gives, evenly along it."""
    sizes = [cause.posterior.size[1] for cause in causes]
    shares = np.cumsum([cause.probability for cause in causes])
    ends = np.round(shares / shares[-1] * min(sizes)).astype(int)
    given = np.maximum(np.diff(ends, prepend=0), 1)
    return [
        np.linspace(0, size - 1, each).round().astype(int)
        for size, each in zip(sizes, given, strict=True)
    ]


def _values(name: str, causes: Sequence[Cause], rows, effects) -> np.ndarray:
    """Return the draws of a site, [draw, …], of a cause without it at its null."""
    groups = [group_of(cause.posterior.tree, "posterior") for cause in causes]
    first = next(k for k, group in enumerate(groups) if name in group)
    # The shape of an absent effect is as in its prior, unless it is fixed.
    prior = group_of(causes[first].posterior.tree, "prior")
    spare = (prior if name in prior else groups[first])[name].values
    shape, nulls, parts = groups[first][name].shape[2:], _nulls(effects), []
    for cause, group, kept in zip(causes, groups, rows, strict=True):
        size = *cause.posterior.size, *shape
        if name in group:
            every = group[name].values
        elif name in nulls:
            every = np.full(size, nulls[name])
        else:
            every = np.resize(spare, size)
        parts.append(every[:, kept])
    return np.concatenate(parts, axis=1).reshape(-1, *shape)


def _nulls(effects: Sequence[type[Effect]]) -> dict[str, float]:
    """Return the null value of the amplitudes of effects and of other sites."""
    return dict.fromkeys(_AT_ZERO, 0.0) | {
        f"{effect.name}.{name}": spec.null
        for effect in without_scatter(effects)
        for name, spec in parameters(effect).items()
        if spec.null is not None
    }
