"""Make-believe rigs: cases built in memory, and the truth that made them."""

from dataclasses import replace

import jax
import numpy as np
from readings import draw_reading

from hdcal.data.case import Case, Gear
from hdcal.data.priors import (
    SCALE_UNITS,
    effect_priors,
    material_priors,
    rig_priors,
)
from hdcal.data.records import Geometry, Records
from hdcal.inference import laplace
from hdcal.inference.distributions import distribution
from hdcal.inference.force_model.problem import build_problem
from hdcal.inference.force_model.serial_correlation import CORRELATION
from hdcal.inference.force_model.structure import ModelStructure
from hdcal.inference.force_model.values import build_effects, member_base, with_rounding
from hdcal.inference.sample import sample
from hdcal.physics.chain import predict_reading
from hdcal.physics.effect import Noise

BASE = ("K", "E0", "alpha", "force_offset", "deformation_offset", "sigma")


def make_gear(*, resolution=0.0, reading="radial", theory="ring", **priors) -> Gear:
    """Return the XB1-100-80 with the shipped priors, some of them replaced."""
    table = rig_priors() | material_priors("40CrNiMoA") | priors
    return Gear(
        name="test gear",
        geometry=Geometry(0.68, 40.0, 70.0, 62.0, 0.29),
        material="40CrNiMoA",
        theory=theory,
        reading=reading,
        reference_temperature=20.0,
        force_resolution=resolution,
        nominal_deformation=0.4,
        priors={name: table[name] for name in BASE},
        scale_priors={name: table[name] for name in SCALE_UNITS},
    )


def make_records(deformation, force=None, *, known=(), **columns) -> Records:
    """Return records, absent covariates neutral; loading unless `sense` says not."""
    n = len(deformation)
    rows = {
        "deformation": np.asarray(deformation, dtype=float),
        "temperature": np.full(n, 20.0),
        "time": np.zeros(n),
        "angle": np.zeros(n),
        "direction": np.ones(n),
        "sense": np.ones(n),
        "rate": np.zeros(n),
        "run": np.zeros(n, dtype=int),
        "specimen": np.zeros(n, dtype=int),
        "force": np.zeros(n) if force is None else np.asarray(force, dtype=float),
        "force_sd": np.zeros(n),
    }
    return Records(**{**rows, **columns}, known=frozenset(known))


def make_case(records: Records, gear: Gear | None = None) -> Case:
    """Return a case with labels 0, 1, … for its runs and specimens."""
    return Case(
        name="test",
        gear=gear or make_gear(),
        records=records,
        run_labels=tuple(map(str, range(int(records.run.max()) + 1))),
        specimen_labels=tuple(map(str, range(int(records.specimen.max()) + 1))),
        data_sha256="0" * 64,
    )


def ramp(rows: int = 14) -> Records:
    """Return one monotone ramp at one temperature, as in the article."""
    return make_records(np.linspace(0.02, 0.54, rows))


def cycles(rows: int = 48, start: float = 0.02) -> Records:
    """Return load/unload cycles at three temperatures out of order, with time.

    The gear is turned a little after every reading.
    """
    half = rows // 6
    up = np.linspace(start, 0.54, half)
    sense = np.concatenate([np.ones(half), -np.ones(half)])
    return make_records(
        np.tile(np.concatenate([up, up[::-1]]), 3),
        known={"temperature", "time", "angle", "unloading"},
        temperature=np.repeat([20.0, 80.0, 50.0], 2 * half),
        time=np.arange(6 * half) * 15.0,
        angle=np.arange(6 * half) * 2.4,
        sense=np.tile(sense, 3),
        direction=np.tile(sense, 3),
    )


def program(start: float = -0.1) -> Records:
    """Return three cycles at three temperatures and speeds, held at the top."""
    up, steps, held = np.linspace(start, 0.54, 30), np.array([0.2, 1.0, 4.0]), 20.0
    one = np.concatenate([up, np.full(6, up[-1]), up[::-1]])
    direction = np.repeat([1.0, 0.0, -1.0], [30, 6, 30])
    pace = np.concatenate([np.where(direction == 0.0, held, s) for s in steps])
    speed = np.repeat((up[1] - up[0]) / steps, len(one))
    direction = np.tile(direction, 3)
    return make_records(
        np.tile(one, 3),
        known={"temperature", "time", "unloading", "cycles"}
        | {"holds", "rates", "holds or rates"},
        temperature=np.repeat([20.0, 80.0, 50.0], len(one)),
        time=np.cumsum(pace),
        sense=np.where(direction == 0.0, 1.0, direction),
        direction=direction,
        rate=direction * speed,
    )


def draw_truth(problem, key) -> dict:
    """Draw one set of parameters from the priors of a problem."""
    values = {}
    for name, prior in problem.priors.items():
        key, own = jax.random.split(key)
        if prior.family == "fixed":
            values[name] = np.float64(prior.numbers[0])
        else:
            law = distribution(prior, name)
            values[name] = np.asarray(law.sample(own))
    return values


def autoregression(score, run, correlation: float) -> np.ndarray:
    """Return first-order autoregressions of sd 1, anew in each run.

    Args:
        score: independent and of sd 1, shape (n,).
        run: index of the run; rows of a run follow one another.
        correlation: of neighbours.
    """
    found = np.array(score)
    for row in range(1, len(found)):
        if run[row] == run[row - 1]:
            new = np.sqrt(1.0 - correlation**2) * found[row]
            found[row] = correlation * found[row - 1] + new
    return found


def simulate(problem, case: Case, truth: dict, key) -> Case:
    """Return the case with readings drawn from the model with these parameters."""
    base = member_base(problem, truth)
    effects = build_effects(problem, truth)
    mean, noise = predict_reading(base, effects, case.records, problem.reading)
    if problem.rounded:
        noise = with_rounding(noise, case.gear.force_resolution, rounded=True)
    if problem.correlated and (correlation := truth.get(CORRELATION, 0.0)):
        score = np.asarray(jax.random.normal(key, mean.shape))
        error = autoregression(score, case.records.run, correlation)
        mean = mean + noise.sd[0] * error
        noise = Noise(noise.log_weight, 1e-12 * noise.sd)
    force = np.asarray(draw_reading(key, mean, noise, case.gear.force_resolution))
    return replace(case, records=replace(case.records, force=force))


def posterior_draws(
    case: Case, effects, seed: int, structure: ModelStructure | None = None, **settings
) -> tuple:
    """Fit a case; return its problem and draws, chains joined."""
    problem = build_problem(case, effect_priors(), effects, structure=structure)
    draws = sample(problem, laplace.fit(problem), seed, **settings)
    return problem, {n: v.reshape(-1, *v.shape[2:]) for n, v in draws.values.items()}
