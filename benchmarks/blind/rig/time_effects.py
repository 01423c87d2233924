"""Mechanisms that depend on time and on the number of cycles."""

import numpy as np

from benchmarks.blind.rig.virtual_rig import Mechanism, RigState, Shape


def solid(force, state: RigState, size: float, shape: Shape):
    """Three Prony arms over a decade and a half; size: share that relaxes."""
    history, drive = state.history, state.stiffness * state.deformation
    tau = shape["tau"] * np.array([0.2, 1.0, 5.0])
    lost, held, before = np.zeros(len(force)), np.zeros(3), 0.0
    for row in range(len(force)):
        if history.run_starts[row]:
            held, before = np.zeros(3), 0.0
        decay = np.exp(-history.steps[row] / tau)
        held = held * decay + (drive[row] - before) * 0.5 * (1.0 + decay)
        lost[row], before = drive[row] - shape["share"] @ held, drive[row]
    return -size * lost


def _arms(rng) -> Shape:
    tau = np.exp(rng.uniform(np.log(8.0), np.log(150.0)))
    return {"tau": tau, "share": rng.dirichlet([1.5, 4.0, 1.5])}


def fatigue(force, state: RigState, size: float, shape: Shape):
    """Stiffness falls with the cycles, fast at first; size: loss over ten cycles."""
    cycle, gear = state.history.cycle, state.history.specimen
    first = [cycle[gear == each][0] for each in np.unique(gear)]
    count = (cycle - np.asarray(first)[gear]) / 9.0
    return -size * state.stiffness * state.deformation * count ** shape["power"]


def charge_amplifier(force, state: RigState, size: float, shape: Shape):
    """Charge leaks off, a part of it five times slower; size: rate at first [1/s].

    The circuit is a feedback capacitor whose dielectric has a second, slower arm. It is
    exact where the force is linear in time between rows, and reset in each run.
    """
    history, slow = state.history, shape["slow"]
    rate = size / (1.0 - 0.8 * slow) * np.array([1.0, 0.2])
    part, charge, read = np.array([1.0 - slow, slow]), np.zeros(2), force.copy()
    before = 0.0
    for row in range(len(force)):
        if history.run_starts[row]:
            charge, before = np.zeros(2), 0.0
        lost = rate * history.steps[row]
        arrived = -np.expm1(-lost) / np.maximum(lost, 1e-12)
        arrived = np.where(lost > 0.0, arrived, 1.0)
        charge = charge * np.exp(-lost) + part * (force[row] - before) * arrived
        read[row], before = charge.sum(), force[row]
    return read - force


def bias_current(force, state: RigState, size: float, shape: Shape):
    """A bias current charges a leaking capacitor; size: mean rate of a run [N/s]."""
    history, settle = state.history, shape["settle"]
    whole = history.run_length
    return size * whole * np.expm1(-history.time / settle) / np.expm1(-whole / settle)


_TIME = frozenset({"time"})

TIME: dict[str, Mechanism] = {
    "relaxation": Mechanism(
        "path", solid, 0.15, frozenset({"time", "holds or rates"}), draw=_arms
    ),
    "stiffness_fatigue": Mechanism(
        "gear",
        fatigue,
        0.06,
        frozenset({"cycles"}),
        draw=lambda rng: {"power": rng.uniform(0.2, 0.6)},
    ),
    "charge_leakage": Mechanism(
        "reading",
        charge_amplifier,
        0.01,
        _TIME,
        draw=lambda rng: {"slow": rng.uniform(0.0, 0.3)},
    ),
    "amplifier_drift": Mechanism(
        "reading",
        bias_current,
        0.3,
        _TIME,
        draw=lambda rng: {"settle": np.exp(rng.uniform(np.log(800.0), np.log(8000.0)))},
        signed=True,
    ),
}
