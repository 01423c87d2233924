"""Mechanisms between the force and its reading, and those of the noise itself."""

from collections.abc import Callable

import numpy as np

from hdcal.blind.virtual_rig.history import FULL
from hdcal.blind.virtual_rig.mechanism import (
    Mechanism,
    RigState,
    Shape,
    bent_line,
    draw_bend,
    draw_members,
)


def charge_amplifier(force, state: RigState, size: float, shape: Shape):
    """Charge leaks off, a part of it five times slower; size: rate at first [1/s].

    The circuit is a feedback capacitor whose dielectric has a second, slower arm; it
    is exact where the force is linear in time between rows, and reset in each run.
    """
    starts, time, slow = state.history.run_starts, state.history.time, shape["slow"]
    rate = size / (1.0 - 0.8 * slow) * np.array([1.0, 0.2])
    part, charge, read = np.array([1.0 - slow, slow]), np.zeros(2), force.copy()
    before = then = 0.0
    for row in range(len(force)):
        if starts[row]:
            charge, before, then = np.zeros(2), 0.0, time[row]
        lost = rate * (time[row] - then)
        arrived = -np.expm1(-lost) / np.maximum(lost, 1e-12)
        arrived = np.where(lost > 0.0, arrived, 1.0)
        charge = charge * np.exp(-lost) + part * (force[row] - before) * arrived
        read[row], before, then = charge.sum(), force[row], time[row]
    return read - force


def bias_current(force, state: RigState, size: float, shape: Shape):
    """A bias current charges a leaking capacitor; size: mean rate of a run [N/s]."""
    history, settle = state.history, shape["settle"]
    whole = history.run_length
    return size * whole * np.expm1(-history.time / settle) / np.expm1(-whole / settle)


def clipping(force, state: RigState, size: float, shape: Shape):
    """The amplifier compresses near its limit; size: full scale over the limit."""
    place = size * np.abs(force) / (np.mean(state.stiffness) * FULL)
    return force * ((1.0 + place ** shape["power"]) ** (-1.0 / shape["power"]) - 1.0)


def remounting(force, state: RigState, size: float, shape: Shape):
    """Every mounting has a zero of its own; size: sd [N]."""
    return size * shape["members"][state.history.run]


_TIME, _TEMPERATURE = frozenset({"time"}), frozenset({"temperature"})

SENSING: dict[str, Mechanism] = {
    "charge_leakage": Mechanism(
        "reading",
        charge_amplifier,
        0.01,
        _TIME,
        draw=lambda rng: {"slow": rng.uniform(0.0, 0.3)},
        amplitude="charge_leakage.rate",
    ),
    "amplifier_drift": Mechanism(
        "reading",
        bias_current,
        0.3,
        _TIME,
        draw=lambda rng: {"settle": np.exp(rng.uniform(np.log(800.0), np.log(8000.0)))},
        signed=True,
        amplitude="amplifier_drift.rate",
    ),
    # The zero of the bridge moves [N/K].
    "thermal_zero_drift": Mechanism(
        "reading",
        bent_line,
        0.6,
        _TEMPERATURE,
        draw=draw_bend,
        signed=True,
        amplitude="thermal_zero_drift.slope",
    ),
    "force_saturation": Mechanism(
        "reading", clipping, 0.6, draw=lambda rng: {"power": rng.uniform(1.7, 2.6)}
    ),
    "run_offset": Mechanism(
        "reading",
        remounting,
        6.0,
        frozenset({"runs"}),
        draw=draw_members,
    ),
}


def rounding(force, size: float, rng: np.random.Generator):
    """An ADC rounds; size: rms of its error [N]."""
    step = size * np.sqrt(12.0)
    return step * np.round(force / step) - force


def gain_noise(force, size: float, rng: np.random.Generator):
    """The excitation is unsteady: noise grows with the force; size: its rms [N]."""
    shape = np.abs(force) ** rng.uniform(0.8, 1.3)
    return size * shape / np.sqrt(np.mean(shape**2)) * rng.normal(size=len(force))


def spikes(force, size: float, rng: np.random.Generator):
    """Some readings are struck, more often upwards; size: rms over all rows [N]."""
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
