"""Posteriors that nobody sampled: draws written down, for what only reads them."""

from dataclasses import asdict, replace

import numpy as np
import xarray as xr
from rigs import make_case, make_gear, make_records
from structures import form_of

from hdcal.calibration.calibrate import choose_effects
from hdcal.data.case import Case, Gear
from hdcal.data.priors import Prior, effect_priors
from hdcal.inference.checks import Check
from hdcal.inference.diagnostics import Convergence
from hdcal.inference.force_model.priors import problem_priors
from hdcal.inference.force_model.problem import build_problem
from hdcal.inference.force_model.serial_correlation import CORRELATION
from hdcal.inference.posterior import STRUCTURE, Posterior
from hdcal.inference.posterior_tree import data_groups, dataset
from hdcal.physics.effect import parameters
from hdcal.physics.registry import EFFECTS
from hdcal.versions import versions

CHAINS = 2
DRIFTS = ("thermal_zero_drift", "thermal_expansion")
BY_PRIOR = ("alpha", "E0", "gap_length")


def written_posterior(
    case: Case, draws: dict, *, effects=(), with_gap: bool = False
) -> Posterior:
    """Return a usable posterior with these draws [draw, …] in two chains."""
    chosen = choose_effects(effects)
    priors = problem_priors(case, chosen, effect_priors(), case.gear.theory)
    form = form_of(case, chosen, with_gap)
    if form.correlated:
        draws = {CORRELATION: np.zeros(len(draws["K"])), **draws}
    shaped = {
        name: np.asarray(v, float).reshape(CHAINS, -1, *np.shape(v)[1:])
        for name, v in draws.items()
    }
    size = shaped["K"].shape[1]
    stats = {"diverging": np.zeros((CHAINS, size), bool)}
    stats["n_steps"] = np.full((CHAINS, size), 7)
    labels = {"run_label": case.run_labels, "specimen_label": case.specimen_labels}
    tree = xr.DataTree.from_dict(
        {
            "posterior": dataset(shaped, labels=labels),
            "prior": dataset({n: v[:1] for n, v in shaped.items() if v.ndim == 2}),
            "sample_stats": dataset(stats),
            **data_groups(case.records),
        }
    )
    diagnoses = {
        name: Convergence(
            rhat=1.0,
            ess_bulk=1000.0,
            ess_tail=1000.0,
            contraction=0.0 if name in BY_PRIOR else 0.9,
            driven_by="prior" if name in BY_PRIOR else "data",
        )
        for name, values in shaped.items()
        if values.ndim == 2 and name in priors
    }
    settings = {
        "seed": 0,
        "chains": CHAINS,
        "warmup": 1,
        "draws": size,
        "with_gap": with_gap,
        STRUCTURE: asdict(form),
        "target_acceptance": 0.8,
        "versions": versions(),
        "seconds": 0.0,
    }
    checks = (Check("written down", "passed", "for a test"),)
    theory = case.gear.theory
    return Posterior(case, theory, chosen, priors, tree, diagnoses, checks, settings)


def plain_draws(case: Case, size: int = 2000, seed: int = 0) -> dict:
    """Return draws about 205 N/mm, stiffness and zero tied together."""
    rng = np.random.default_rng(seed)
    problem = build_problem(case, effect_priors())
    E0 = rng.normal(207e3, 3e3, size)
    stiffness = rng.normal(205.0, 1.5, size)
    unit = float(problem.unit_stiffness) * problem.reading.radial_per_read
    return {
        "E0": E0,
        "K": stiffness / (E0 * unit),
        "alpha": rng.normal(3e-4, 0.4e-4, size),
        "force_offset": -1.0 - 0.25 * (stiffness - 205.0) + rng.normal(0, 0.2, size),
        "deformation_offset": rng.normal(0.0, 1e-3, size),
        "sigma": 0.6 * np.exp(rng.normal(0.0, 0.15, size)),
        "stiffness": stiffness,
    }


def ramp_case(gear=None, rows: int = 30, **columns) -> Case:
    """Return a ramp to 0.54 mm on one gear, with noise."""
    deformation = np.linspace(0.02, 0.54, rows)
    noise = np.random.default_rng(5).normal(0.0, 0.6, rows)
    records = make_records(deformation, 205.0 * deformation - 1.0 + noise, **columns)
    return make_case(records, gear)


def compensated(gear=None) -> Gear:
    """Return a gear on a rig that no temperature moves."""
    still = {f"{name}.slope": Prior("fixed", (0.0,)) for name in DRIFTS}
    return replace(gear or make_gear(), effect_priors=still)


def regressed(
    deformation, force, rng, size: int = 1000, *, effects=(), **others
) -> Posterior:
    """Return what least squares says of one gear, under flat priors.

    Args:
        deformation: of the rows [mm].
        force: likewise [N].
        rng: draws.
        size: number of draws.
        effects: also in the model, their parameters among the others.
        others: values of parameters, instead of those of least squares.
    """
    case = make_case(make_records(deformation, force))
    columns = np.stack([deformation, np.ones_like(deformation)], axis=1)
    found, left, *_ = np.linalg.lstsq(columns, force, rcond=None)
    sigma = np.sqrt(left[0] / rng.chisquare(len(force) - 2, size))
    root = np.linalg.cholesky(np.linalg.inv(columns.T @ columns))
    slope, zero = (found + sigma[:, None] * (rng.normal(size=(size, 2)) @ root.T)).T
    draws = plain_draws(case, size)
    return written_posterior(
        case,
        draws
        | {
            "K": draws["K"] * slope / draws["stiffness"],
            "stiffness": slope,
            "force_offset": zero,
            "deformation_offset": np.zeros(size),
            "sigma": sigma,
            **{n.replace("__", "."): np.full(size, v) for n, v in others.items()},
        },
        effects=effects,
    )


def single(gear=None, size: int = 2000) -> Posterior:
    """Return a posterior of one gear in one mounting."""
    case = ramp_case(gear)
    return written_posterior(case, plain_draws(case, size))


def spring(size: int = 400) -> Posterior:
    """Return a posterior of a spring, of which no sizes are known."""
    gear = make_gear(theory="spring")
    sizes = replace(gear.geometry, radius=np.nan)
    return single(replace(gear, geometry=sizes, K_theory="spring"), size)


def batch(count: int = 6, size: int = 2000) -> Posterior:
    """Return a posterior of several gears, each in a mounting of its own."""
    label = np.repeat(np.arange(count), 10)
    known = {"run", "specimen", "runs", "specimens"}
    case = ramp_case(rows=10 * count, run=label, specimen=label, known=known)
    rng = np.random.default_rng(1)
    spread = 0.05 * np.sqrt((count - 1) / rng.chisquare(count - 1, size))
    deviation = rng.normal(size=(size, count)) * spread[:, None]
    offset = rng.normal(size=(size, count))
    draws = plain_draws(case, size) | {
        "specimen_sd": spread,
        "specimen_deviation": deviation - deviation.mean(axis=1, keepdims=True),
        "run_offset_sd": np.abs(rng.normal(1.0, 0.2, size)),
        "run_offset": offset - offset.mean(axis=1, keepdims=True),
    }
    return written_posterior(case, draws)


def with_discrepancy(size: int = 2000) -> Posterior:
    """Return a posterior of one gear with a discrepancy of a newton."""
    case, rng = ramp_case(), np.random.default_rng(2)
    draws = plain_draws(case, size) | {
        "gap_sd": np.abs(rng.normal(1.5, 0.3, size)),
        "gap_length": 0.3 * np.exp(rng.normal(0.0, 0.2, size)),
        "gap_weights": rng.normal(0.0, 0.5, (size, 20)) / (1.0 + np.arange(20.0)) ** 2,
    }
    return written_posterior(case, draws, with_gap=True)


def beside(posterior: Posterior, name: str) -> Posterior:
    """Return the same beside an effect that changes nothing."""
    gap = posterior.settings["with_gap"] is True
    draws, spec = posterior.draws, parameters(EFFECTS[name])
    idle = {
        f"{name}.{n}": np.full(len(draws["K"]), p.typical if p.null is None else p.null)
        for n, p in spec.items()
    }
    draws = {**draws, **idle}
    return written_posterior(posterior.case, draws, effects=[name], with_gap=gap)


def stiffer(posterior: Posterior, factor: float) -> Posterior:
    """Return the same with every stiffness multiplied."""
    tree = posterior.tree.copy(deep=True)
    for name in ("K", "stiffness"):
        tree["posterior"][name] = tree["posterior"][name] * factor
    return replace(posterior, tree=tree)
