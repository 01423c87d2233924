"""Classes of effects, and the components that act in draws of each hypothesis.

The gap is the sum of the components, with the base model projected out. A component
acts in a draw where the rows show it, where it is not immaterial, and where it closes a
part of the gap: a tiny coefficient does not act.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from hdcal.diagnosis.which import MATTERS
from hdcal.evidence.linear_problem import LinearProblem
from hdcal.evidence.noise_models import NoiseModel
from hdcal.evidence.parts import mean_curves, sampled_curves
from hdcal.evidence.search import Searched
from hdcal.evidence.table import OUTSIDE, Names

# A component acts from this squared length on, in whitened rows and noise variances.
_SHOWN = 6.0
# Cosine of the angle between a component and the gap below which the component closes
# less than half a per cent of the gap's rms, which would be shown as 0 %.
_ALONG = 0.1
# No draws are made of less probable hypotheses: all that they contain acts.
NEGLIGIBLE, DRAWS = 3e-3, 200
# Effects that close less of the gap than this leave it outside the library.
CARRIED = 0.5
# Cosine of the angle between what the base model leaves of two effects from which they
# are one class: within 18 degrees. One that can only bend the other way is at 180.
ALIKE = 0.95
# An effect is excluded by another one at odds of a hundred (Jeffreys, Theory of
# Probability, 1961: decisive). Effects of less probability lead no class.
_EXCLUDED = _LEAST = 0.01


def classes(
    searched: Searched, posterior: Mapping[Names, np.ndarray]
) -> list[tuple[str, ...]]:
    """Return classes of effects on the mean reading, each with its likeliest first.

    The likeliest effect, as fitted in its likeliest hypothesis, is in one class with
    all that the readings do not exclude in its place and whose curves, each fitted
    alone, coincide with it, or differ on unloading that was not measured. An effect is
    in one class at most.
    """
    keys = [{*key} for key in posterior]
    weights = np.array([each.sum() for each in posterior.values()])

    def chance(name: str, without: Sequence[str] = ()) -> float:
        """Return the probability of an effect, in hypotheses without some others."""
        kept = [name in key and key.isdisjoint(without) for key in keys]
        return float(weights[kept].sum())

    left = sorted(searched.table.names[:-1], key=lambda name: -chance(name))
    found = []
    while left and (most := chance(left[0])) > _LEAST:
        leader = left.pop(0)
        key = max(
            (key for key in posterior if leader in key),
            key=lambda key: posterior[key].sum(),
        )
        group, curve = [leader], direction(searched, key, leader)
        for name in left:
            possible = chance(name, without=group) >= _EXCLUDED * most
            alike = possible and curve @ direction(searched, (name,), name) >= ALIKE
            if alike or _differ_on_unloading(searched, leader, name):
                group.append(name)
        left = [name for name in left if name not in group]
        found.append(tuple(group))
    return found


def _differ_on_unloading(searched: Searched, *names: str) -> bool:
    """Whether effects are bends on loading that only unloading would separate."""
    effects = [searched.effects[name] for name in names]
    loops = all(each.family == "loop" and not each.instantaneous for each in effects)
    return loops and "unloading" not in searched.problem.records.known


def direction(searched: Searched, key: Names, name: str) -> Float[np.ndarray, " n"]:
    """Return what the base model leaves of an effect of a hypothesis, of unit length.

    Zero where the hypothesis has no evidence.
    """
    table, problem = searched.table, searched.problem
    parts = table.parts.get(key, [])
    names = [table.names[part.component] for part in parts]
    if name not in names:
        return np.zeros(len(problem.y))
    curves = mean_curves(problem, table.likeliest_noise(key), parts)
    curve = curves[names.index(name)]
    return curve / max(float(np.linalg.norm(curve)), 1e-300)


@dataclass(frozen=True)
class Acting:
    """Draws of one hypothesis and noise model in which the same components act.

    On the noise none may act. `closed` are the shares of the rms of the gap [N] that
    each class and the remainder close, by name, `carried` is that of all effects of the
    library together; where no draws were made nothing is known of them.
    """

    weight: float
    components: Names
    noise: str
    closed: Mapping[str, Float[np.ndarray, " d"]]
    carried: Float[np.ndarray, " d"]
    rms: Float[np.ndarray, " d"]

    def hypotheses(self) -> dict[Names, float]:
        """Return hypotheses that stand for the draws, and their shares of them.

        Effects that close less than half of the gap beside something outside are left
        out: they are next to undetermined.
        """
        noise = [self.noise] if self.noise else []
        whole = tuple(sorted([*self.components, *noise]))
        if OUTSIDE not in self.components or len(self.components) == 1:
            return {whole: 1.0}
        alone = float(np.mean(self.carried < CARRIED))
        return {tuple(sorted([OUTSIDE, *noise])): alone, whole: 1.0 - alone}

    def explanations(self) -> dict[Names, float]:
        """Return explanations of the draws and their shares of them.

        An explanation is the set of effects that act, or `OUTSIDE` where these close
        less than half of the gap; () means that nothing acts.
        """
        found: dict[Names, float] = {}
        for names, share in self.hypotheses().items():
            effects = tuple(name for name in names if name != OUTSIDE)
            alone = OUTSIDE in names and {*effects} <= {self.noise}
            found[(OUTSIDE,) if alone else effects] = share
        return found


def acting(
    searched: Searched,
    posterior: Mapping[Names, np.ndarray],
    class_of: Mapping[str, str],
    rng: np.random.Generator,
) -> list[Acting]:
    """Return the components that act in each hypothesis and noise model.

    `class_of` is the name of the class of each effect that has one.
    """
    table, found = searched.table, []
    for key, chance in posterior.items():
        by_noise: dict[str, float] = defaultdict(float)
        for noise, each in zip(table.noises, chance, strict=True):
            by_noise[noise.name] += float(each)
        probable = bool(key) and max(by_noise.values()) >= NEGLIGIBLE
        drawn = [*_drawn(searched, key, class_of, rng)] if probable else []
        whole = [Acting(1.0, key, "", {}, np.ones(1), np.zeros(0))]
        for name, weight in by_noise.items():
            for each in drawn if weight >= NEGLIGIBLE and drawn else whole:
                share = each.weight * weight
                found.append(replace(each, weight=share, noise=name))
    return found


def _drawn(
    searched: Searched,
    key: Names,
    class_of: Mapping[str, str],
    rng: np.random.Generator,
) -> Iterator[Acting]:
    """Yield draws of one hypothesis, by which of its components act."""
    problem, table = searched.problem, searched.table
    parts, noise = table.parts[key], table.likeliest_noise(key)
    names = [table.names[part.component] for part in parts]
    curves, own = sampled_curves(problem, noise, parts, DRAWS, rng)
    # Structure within the rounding of a coarse reading shows nothing.
    largest = float(np.max(np.abs(problem.records.force)))
    least = max(MATTERS * largest, searched.coarse_step / np.sqrt(12.0))
    shown = acts_in(problem, noise, curves, least)
    gaps = np.sum(curves, axis=0)
    for pattern in np.unique(shown.T, axis=0):
        these = np.all(pattern == shown.T, axis=1)
        acts = [k for k, on in enumerate(pattern) if on]
        curve = {names[k]: own[k, these] for k in acts}
        gap = gaps[these]
        classes: dict[str, list[np.ndarray]] = defaultdict(list)
        for name, values in curve.items():
            classes[class_of.get(name, name)].append(values)
        effects = [values for name, values in curve.items() if name != OUTSIDE]
        yield Acting(
            weight=float(these.mean()),
            components=tuple(sorted(curve)),
            noise="",
            closed={name: share_closed(gap, each) for name, each in classes.items()},
            carried=share_closed(gap, effects),
            rms=np.sqrt(np.mean(gap**2, axis=1)),
        )


def acts_in(
    problem: LinearProblem,
    noise: NoiseModel,
    curves: Float[np.ndarray, "k d n"],
    least: float,
) -> Bool[np.ndarray, "k d"]:
    """Return in which draws each component acts; `least` is its least rms [N]."""
    white = problem.whiten(curves, noise.weight, noise.correlation)
    gaps = np.sum(curves, axis=0)
    along = np.einsum("kdn,dn->kd", curves, gaps)
    lengths = np.linalg.norm(curves, axis=2) * np.linalg.norm(gaps, axis=1)
    shows = np.sum(white**2, axis=2) > _SHOWN * problem.noise_sd**2
    matters = np.mean(curves**2, axis=2) > least**2
    return shows & matters & (along > _ALONG * lengths)


def share_closed(
    gap: Float[np.ndarray, "d n"], curves: Sequence[Float[np.ndarray, "d n"]]
) -> Float[np.ndarray, " d"]:
    """Return the share of the rms of gaps that one or two curves close.

    At their best amplitudes, which are not negative: a curve that points away from the
    gap closes nothing.
    """
    if not len(curves):
        return np.zeros(len(gap))
    stacked = np.stack(curves, axis=1)
    along = np.einsum("dkn,dn->dk", stacked, gap)
    gram = stacked @ np.swapaxes(stacked, 1, 2)
    own = np.maximum(np.einsum("dkk->dk", gram), 1e-300)
    best = np.max(np.maximum(along, 0.0) ** 2 / own, axis=1)
    if len(curves) == 2:
        ridge = 1e-9 * np.trace(gram, axis1=1, axis2=2)[:, None, None] * np.eye(2)
        both = np.linalg.solve(gram + ridge, along[..., None])[..., 0]
        inside = np.all(both > 0.0, axis=1)
        best = np.where(inside, np.sum(both * along, axis=1), best)
    left = 1.0 - best / np.maximum(np.sum(gap**2, axis=1), 1e-300)
    return 1.0 - np.sqrt(np.clip(left, 0.0, 1.0))
