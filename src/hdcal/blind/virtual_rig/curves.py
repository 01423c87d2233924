"""Curves that several mechanisms outside the library are made of."""

import numpy as np

from hdcal.blind.virtual_rig.history import Floats, History


def drawn_place(
    history: History, rng: np.random.Generator, low: float, high: float
) -> float:
    """Draw a deformation [mm] between two shares of the stroke."""
    return float(np.max(history.deformation)) * rng.uniform(low, high)


def bell(history: History, place: float, width: float) -> Floats:
    """One at a deformation [mm], falling off over a width [mm]."""
    return np.exp(-0.5 * ((history.deformation - place) / width) ** 2)


def beyond(history: History, place: float | Floats) -> Floats:
    """Deformation beyond a place, per tenth of a millimetre."""
    return np.maximum(history.deformation - place, 0.0) / 0.1


def to_one(curve: Floats) -> Floats:
    """Scale to a largest size of one; a curve of zeros stays as it is."""
    return curve / max(float(np.max(np.abs(curve))), 1e-9)
