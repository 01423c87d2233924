"""Simulated streams, and what a tracker makes of them."""

import copy
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from equinox import tree_at

from hdcal.tracking.tracker import StreamReading, Tracker


class Followed(NamedTuple):
    """What a tracker answered.

    Attributes:
        answers: to each row.
        inside: whether each reading lies in its 95 % interval.
        stiffness: the last 95 % interval [N/mm].
    """

    answers: list[dict]
    inside: np.ndarray
    stiffness: list[float]

    @property
    def alarms(self) -> np.ndarray:
        """Rows with an alarm, from 0."""
        return np.flatnonzero([answer["alarm"] for answer in self.answers])


def follow(start: Tracker, deformation, force, temperature=None) -> Followed:
    """Follow a stream with a copy of a tracker."""
    warm = np.full(len(force), np.nan) if temperature is None else temperature
    readings = [
        StreamReading(deformation=x, force=y, temperature=None if np.isnan(t) else t)
        for x, y, t in zip(
            *map(np.ndarray.tolist, (deformation, force, warm)), strict=True
        )
    ]
    answers = copy.deepcopy(start).follow(readings)
    bands = np.array([answer["force_N"]["predictive_95"] for answer in answers])
    inside = (bands[:, 0] <= force) & (force <= bands[:, 1])
    return Followed(answers, inside, answers[-1]["stiffness_N_per_mm"]["credible_95"])


def correlated(rng, rho: float, count: int) -> np.ndarray:
    """Return noise of unit sd, autoregressive of first order."""
    noise = rng.normal(size=count)
    for row in range(1, count):
        noise[row] = rho * noise[row - 1] + np.sqrt(1.0 - rho**2) * noise[row]
    return noise


def with_correlation(tracker: Tracker, rho: float) -> Tracker:
    """Let a tracker take this correlation of the noise for known."""
    known = 1e24 * jnp.array([rho, 1.0])
    tracker._bank = tree_at(lambda bank: bank.products, tracker._bank, known)
    return tracker
