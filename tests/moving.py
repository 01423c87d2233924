"""Make-believe vibration tests: a gear that was released, and the truth about it."""

import numpy as np
from rigs import make_case, make_gear, make_records

from hdcal.inference.problem import unit_stiffness
from hdcal.physics.linear_response import linear_response
from hdcal.rig.priors import dynamic_priors

TRUTH = {
    "K": 2.45,
    "E0": 207e3,
    "mass": 4.0e-5,
    "damping_ratio": 0.02,
    "deformation_offset": 0.004,
    "deformation_sigma": 0.003,
}


def moving_gear(**priors):
    """Return the test gear with what its file says of a moving gear."""
    from dataclasses import replace

    own = dynamic_priors() | priors
    return replace(make_gear(), dynamic_priors=own, density=7.85e-9)


def release(rows: int = 200, rate: float = 4000.0):
    """Return time and force: 40 N held, let go within a millisecond."""
    time = np.arange(rows) / rate
    held = 0.3 * time[-1]
    return time, 40.0 * np.clip(1.0 - (time - held) / 1e-3, 0.0, 1.0)


def motion(truth: dict, case) -> tuple[float, float, float]:
    """Return mass, damping and stiffness of a truth."""
    stiffness = truth["K"] * truth["E0"] * unit_stiffness(case, "ring")
    damping = 2.0 * truth["damping_ratio"] * np.sqrt(stiffness * truth["mass"])
    return truth["mass"], damping, stiffness


def moving_case(seed: int, gear=None, truth=TRUTH, rows: int = 200):
    """Return a case of a released gear, read with noise."""
    time, force = release(rows)
    columns = {"known": {"time"}, "time": time}
    blank = make_records(np.zeros(rows), force, **columns)
    case = make_case(blank, gear or moving_gear())
    parts = motion(truth, case)
    start = np.array([force[0] / parts[2], 0.0])
    clean = np.asarray(linear_response(*parts, time, force, start))[:, 0]
    noise = np.random.default_rng(seed).normal(0.0, truth["deformation_sigma"], rows)
    read = clean + truth["deformation_offset"] + noise
    return make_case(make_records(read, force, **columns), case.gear)
