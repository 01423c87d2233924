"""Make-believe vibration tests: a gear that was released, and the truth about it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from posteriors import written_posterior
from rigs import make_case, make_gear, make_records
from scipy.integrate import solve_ivp

from hdcal import EFFECTS
from hdcal.data.priors import dynamic_priors
from hdcal.inference.force_model.priors import unit_stiffness
from hdcal.physics.linear_response import LinearGear, linear_response

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
    own = dynamic_priors() | priors
    return replace(make_gear(), dynamic_priors=own, density=7.85e-9)


def release(rows: int = 200, rate: float = 4000.0):
    """Return time and force: 40 N held, let go within a millisecond."""
    time = np.arange(rows) / rate
    held = 0.3 * time[-1]
    return time, 40.0 * np.clip(1.0 - (time - held) / 1e-3, 0.0, 1.0)


def motion(truth: dict, case) -> LinearGear:
    """Return mass, damping and stiffness of a truth."""
    stiffness = truth["K"] * truth["E0"] * unit_stiffness(case, "ring")
    damping = 2.0 * truth["damping_ratio"] * np.sqrt(stiffness * truth["mass"])
    return LinearGear(truth["mass"], damping, stiffness)


def moving_case(seed: int, gear=None, truth=TRUTH, rows: int = 200):
    """Return a case of a released gear, read with noise."""
    time, force = release(rows)
    columns = {"known": {"time"}, "time": time}
    blank = make_records(np.zeros(rows), force, **columns)
    case = make_case(blank, gear or moving_gear())
    linear = motion(truth, case)
    start = np.array([force[0] / linear.stiffness, 0.0])
    clean = np.asarray(linear_response(linear, time, force, start))[:, 0]
    noise = np.random.default_rng(seed).normal(0.0, truth["deformation_sigma"], rows)
    read = clean + truth["deformation_offset"] + noise
    return make_case(make_records(read, force, **columns), case.gear)


def frictional_case(seed, ratio, friction):
    """Return a case of a released gear with a damping ratio and dry friction [N]."""
    truth = TRUTH | {"damping_ratio": ratio}
    case = moving_case(seed, None, truth)
    (time, force), linear = release(), motion(truth, case)

    def moved(rubbing: float) -> np.ndarray:
        """Integrate, with the sign of friction changing over 10 µm/s."""

        def rates(at, state):
            drag = linear.damping * state[1] + rubbing * np.tanh(state[1] / 0.01)
            push = np.interp(at, time, force) - drag - linear.stiffness * state[0]
            return [state[1], push / linear.mass]

        start = [force[0] / linear.stiffness, 0.0]
        exact = {"method": "Radau", "rtol": 1e-7, "atol": 1e-9, "max_step": 1e-3}
        # Held, the gear has no error of integration.
        with np.errstate(divide="ignore"):
            return solve_ivp(rates, time[[0, -1]], start, t_eval=time, **exact).y[0]

    read = case.records.deformation + (moved(friction) - moved(0.0))
    return make_case(make_records(read, force, known={"time"}, time=time), case.gear)


GEAR = """\
[gear]
wall_thickness_mm = 0.68
radius_mm = 40.0
length_mm = 70.0
material = "40CrNiMoA"
"""


def write_moving(case, folder: Path) -> Path:
    """Write a case as a folder that the command line reads."""
    folder.mkdir()
    records = case.records
    table = np.column_stack([records.time, records.force, records.deformation])
    header = "time_s,force_N,deformation_mm"
    np.savetxt(folder / "data.csv", table, delimiter=",", header=header, comments="")
    (folder / "gear.toml").write_text(GEAR, "utf-8")
    return folder


def still_posterior(effects: dict | None = None, *, gap=None, K: float = 0.0):
    """Return a calibration at rest of which only K is uncertain.

    Args:
        effects: value of each `effect.parameter`.
        gap: weights of the discrepancy, or None.
        K: relative sd of K over the draws.
    """
    names = dict.fromkeys(name.partition(".")[0] for name in effects or {})
    known = frozenset().union(*(EFFECTS[name].needs for name in names))
    deformation, size = np.linspace(0.02, 0.54, 14), 200
    records = make_records(deformation, 200.0 * deformation, known=known)
    case = make_case(records, moving_gear())
    scatter = np.random.default_rng(0).standard_normal(size)
    influence = TRUTH["K"] * np.exp(K * scatter)
    values = {"E0": 207e3, "alpha": 3e-4, "deformation_offset": 0.0, "sigma": 1.0}
    values |= {"force_offset": 0.0, **(effects or {})}
    draws = {name: np.full(size, value) for name, value in values.items()}
    stiffness = influence * 207e3 * unit_stiffness(case, "ring")
    draws |= {"K": influence, "stiffness": stiffness}
    if gap is not None:
        draws |= {"gap_weights": np.tile(gap, (size, 1))}
        draws |= {name: np.ones(size) for name in ("gap_sd", "gap_length")}
    return written_posterior(case, draws, effects=names, with_gap=gap is not None)
