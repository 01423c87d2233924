"""The gap between the base model and the readings, row by row and model by model."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from hdcal.data.records import Records
from hdcal.evidence.noise_models import NoiseModel
from hdcal.evidence.parts import posterior, sampled_curves
from hdcal.evidence.search import Searched
from hdcal.evidence.table import OUTSIDE, Names

_DRAWS = 600


@dataclass(frozen=True)
class GapByRow:
    """What the base model leaves of the readings.

    Attributes:
        records: the rows that were diagnosed, run after run: all, means of neighbours,
            or one of several.
        residual: reading less the base model fitted alone [N], shape (n,).
        draws: of the gap, over all hypotheses [N], shape (d, n).
    """

    records: Records
    residual: Float[np.ndarray, " n"]
    draws: Float[np.ndarray, "d n"]


@dataclass(frozen=True)
class Fitted:
    """The likeliest hypothesis with some effects, fitted to all rows.

    Attributes:
        noise: its model of the noise.
        noise_sd: of a typical row [N].
        rms: what the base model leaves, then with each effect in addition, then with a
            remainder outside the library [N], by what was added last.
    """

    noise: NoiseModel
    noise_sd: float
    rms: Mapping[str, float]


def gap_by_row(
    searched: Searched,
    posterior_of: Mapping[Names, np.ndarray],
    rng: np.random.Generator,
) -> GapByRow:
    """Return residuals and posterior draws of the gap.

    Args:
        searched: hypotheses of the case.
        posterior_of: probability of each, by model of the noise.
        rng: source of randomness.
    """
    problem, table = searched.problem, searched.table
    keys = [*posterior_of]
    chance = np.array([posterior_of[key].sum() for key in keys])
    draws = [np.zeros((0, len(problem.y)))]
    for key, count in zip(keys, rng.multinomial(_DRAWS, chance), strict=True):
        noise, parts = table.likeliest_noise(key), table.parts[key]
        if count and not parts:
            draws.append(np.zeros((count, len(problem.y))))
        elif count:
            curves = sampled_curves(problem, noise, parts, int(count), rng)
            draws.append(curves.whole.sum(axis=0))
    # The gap is projected in the same way, so that it lies among the residuals.
    residual = problem.project(problem.y)
    return GapByRow(problem.records, residual, np.concatenate(draws))


def fitted(
    searched: Searched,
    posterior_of: Mapping[Names, np.ndarray],
    names: Sequence[str],
) -> Fitted:
    """Return the likeliest of the hypotheses that contain most of some effects.

    Args:
        searched: hypotheses of the case.
        posterior_of: probability of each, by model of the noise.
        names: of the effects on the mean reading; a hypothesis contains two at most.
    """
    problem, table = searched.problem, searched.table
    key = max(
        posterior_of,
        key=lambda each: (len({*names} & {*each}), posterior_of[each].sum()),
    )
    noise, parts = table.likeliest_noise(key), table.parts[key]
    by_name = {table.names[part.component]: part for part in parts}
    rms, added = {}, []
    for name in ("", *names, *({*key} - {*names} - {OUTSIDE}), OUTSIDE):
        if name in by_name:
            added.append(by_name[name])
        if name in by_name or not name:
            left = problem.y - posterior(problem, noise, added).reading
            rms[name] = float(np.sqrt(np.mean(left**2)))
    found = posterior(problem, noise, parts)
    left = (problem.y - found.reading) * noise.weight
    used = len(found.mean) - float(np.sum(found.factor**2))
    free = max(problem.count - used, 1.0)
    return Fitted(noise, float(np.sqrt(left @ left / free)), rms)
