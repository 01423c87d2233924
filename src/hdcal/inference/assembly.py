"""From draws to a posterior: what every kind of calibration does after sampling."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from hdcal.data.case import Case
from hdcal.data.priors import Prior
from hdcal.data.versions import versions
from hdcal.inference.checks import (
    Check,
    bound_check,
    conflict_check,
    identification_checks,
    sampling_checks,
)
from hdcal.inference.density import densities
from hdcal.inference.diagnostics import Diagnosis, diagnose_parameters
from hdcal.inference.distributions import sample_prior
from hdcal.inference.flat_directions import dead_parameters, flat_directions
from hdcal.inference.mixing import mixing
from hdcal.inference.posterior_tree import build_tree
from hdcal.inference.sample import Draws
from hdcal.inference.sampled_problem import Sampled

_PRIOR_DRAWS = 2000


@dataclass(frozen=True)
class Specifics:
    """What one kind of calibration found out that another has no equal of.

    Attributes:
        log_likelihood: by observed column, as `build_tree` takes it.
        slopes: of the mean reading by parameter, in noise sds.
        mixed: what else must have mixed, (chain, draw) each.
        checks: further ones.
        observed: columns of the records that the model explains.
    """

    log_likelihood: Mapping[str, np.ndarray]
    slopes: Mapping[str, np.ndarray]
    mixed: Mapping[str, np.ndarray]
    checks: Sequence[Check]
    observed: tuple[str, ...] = ("force",)


def assemble(
    case: Case,
    priors: Mapping[str, Prior],
    problem: Sampled,
    found: Draws,
    own: Specifics,
    seed: int,
) -> tuple[xr.DataTree, dict[str, Diagnosis], tuple[Check, ...]]:
    """Return the tree, diagnoses and checks of a posterior.

    Args:
        case: data and gear.
        priors: of every site.
        problem: what was sampled.
        found: its draws.
        own: of this kind of calibration.
        seed: of the prior draws.
    """
    weights = densities(problem, found.values)
    centre = {name: np.median(v, axis=(0, 1)) for name, v in found.values.items()}
    # From here on what is compared with the draws is what was believed of them.
    problem = replace(problem, priors=problem.priors_given(centre))
    sampled = {
        name: problem.priors[name]
        for name, prior in priors.items()
        if name in found.values and prior.family != "fixed"
    }
    scalars = {name: found.values[name] for name in sampled}
    diagnoses = diagnose_parameters(scalars, sampled, *weights)
    rng = np.random.default_rng(seed)
    prior_draws = {
        name: sample_prior(prior, name, rng, _PRIOR_DRAWS)
        for name, prior in sampled.items()
    }
    units = {name: prior.unit for name, prior in priors.items() if prior.unit}
    about = units, own.log_likelihood, own.observed
    tree = build_tree(case, found, prior_draws, *about)
    dead = dead_parameters(own.slopes, problem)
    alive = {name: slope for name, slope in own.slopes.items() if name not in dead}
    checks = (
        *sampling_checks(vars(found), diagnoses | mixing(own.mixed)),
        *own.checks,
        conflict_check(scalars, sampled),
        bound_check(scalars, sampled),
        *identification_checks(dead, flat_directions(alive, problem)),
    )
    return tree, diagnoses, checks


def run_settings(found: Draws, began: float) -> dict[str, object]:
    """Return what the file says of a run beside what was asked for.

    Args:
        found: its draws.
        began: `time.perf_counter` at its beginning [s].
    """
    return {
        "draws": found.energy.shape[1],
        "target_acceptance": found.target_acceptance,
        "versions": versions(),
        "seconds": round(time.perf_counter() - began, 3),
    }
