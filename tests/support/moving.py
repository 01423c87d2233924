"""Make-believe vibration tests: a gear that was released, and the truth about it."""

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import xarray as xr
from rigs import make_case, make_gear, make_records
from structures import form_of

from hdcal import EFFECTS, Posterior
from hdcal.data.priors import dynamic_priors, effect_priors
from hdcal.inference.checks import Check
from hdcal.inference.diagnostics import Convergence
from hdcal.inference.posterior import STRUCTURE
from hdcal.inference.posterior_tree import data_groups, dataset
from hdcal.inference.problem import problem_priors, unit_stiffness
from hdcal.physics.frictional_response import frictional_response
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


def frictional_case(seed, ratio, friction, gear=None, rows: int = 200):
    """Return a case of a released gear with a damping ratio and dry friction [N]."""
    truth = TRUTH | {"damping_ratio": ratio}
    case = moving_case(seed, gear, truth, rows)
    time, force = release(rows)
    linear = motion(truth, case)
    start = np.array([force[0] / linear.stiffness, 0.0])
    smooth = np.asarray(linear_response(linear, time, force, start))[:, 0]
    rubbed = frictional_response(linear, friction, time, force, start)
    read = case.records.deformation - smooth + np.asarray(rubbed)[:, 0]
    known = {"known": {"time"}, "time": time}
    return make_case(make_records(read, force, **known), case.gear)


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


def still_posterior(
    effects: dict | None = None, *, usable: bool = True, gap=None, **spread
):
    """Return a calibration at rest with draws made by hand, no sampler needed.

    Args:
        effects: value of each `effect.parameter`, the same in every draw.
        usable: whether its checks passed.
        gap: weights of the leftover discrepancy, the same in every draw, or None.
        spread: relative sd of K over the draws, as `K`.
    """
    rng = np.random.default_rng(0)
    gear = moving_gear()
    deformation = np.linspace(0.02, 0.54, 14)
    chosen = tuple({EFFECTS[name.partition(".")[0]]: None for name in effects or {}})
    known = frozenset().union(*(effect.needs for effect in chosen))
    records = make_records(deformation, 200.0 * deformation, known=known)
    case = make_case(records, gear)
    shape = (2, 100)
    influence = TRUTH["K"] * np.exp(spread.get("K", 0.0) * rng.standard_normal(shape))
    fixed = {"E0": 207e3, "alpha": 3e-4, "deformation_offset": 0.0}
    fixed |= {"noise_correlation": 0.0} | (effects or {})
    draws = {name: np.full(shape, value) for name, value in fixed.items()}
    unit = unit_stiffness(case, "ring")
    draws |= {"K": influence, "stiffness": influence * 207e3 * unit}
    draws |= {"force_offset": np.zeros(shape), "sigma": np.ones(shape)}
    if gap is not None:
        draws |= {"gap_weights": np.tile(gap, (*shape, 1))}
        draws |= {name: np.ones(shape) for name in ("gap_sd", "gap_length")}
    groups = {"posterior": dataset(draws), **data_groups(records)}
    tree = xr.DataTree.from_dict(groups)
    driven = Convergence(1.0, 400.0, 400.0, 0.99, 0.0, 1.0, "data")
    check = Check("chains agree (R-hat)", "passed" if usable else "failed", "by hand")
    settings = {
        "with_gap": gap is not None,
        STRUCTURE: asdict(form_of(case, chosen, gap is not None)),
        "seed": 0,
        "chains": 2,
        "warmup": 1,
        "draws": 100,
    }
    settings |= {"seconds": 0.0, "versions": {}}
    priors = problem_priors(case, chosen, effect_priors(), "ring")
    return Posterior(
        case, "ring", chosen, priors, tree, {"K": driven}, (check,), settings
    )
