"""Mechanisms of the noise; their size is the rms of the error that they add [N]."""

from collections.abc import Callable

import numpy as np


def rounding(force, size: float, rng: np.random.Generator):
    """An analogue-to-digital converter rounds."""
    step = size * np.sqrt(12.0)
    return step * np.round(force / step) - force


def gain_noise(force, size: float, rng: np.random.Generator):
    """The excitation is unsteady: noise grows with the force."""
    shape = np.abs(force) ** rng.uniform(0.8, 1.3)
    return size * shape / np.sqrt(np.mean(shape**2)) * rng.normal(size=len(force))


def spikes(force, size: float, rng: np.random.Generator):
    """Some readings are disturbed, more often upwards."""
    struck = rng.uniform(size=len(force)) < rng.uniform(0.03, 0.12)
    if not struck.any():
        struck[rng.integers(len(force))] = True
    height = struck * rng.exponential(1.0, len(force))
    height *= np.where(rng.uniform(size=len(force)) < 0.6, 1.0, -1.0)
    return size * height / np.sqrt(np.mean(height**2))


NOISES: dict[str, Callable] = {
    "quantisation": rounding,
    "heteroscedastic_noise": gain_noise,
    "outliers": spikes,
}
