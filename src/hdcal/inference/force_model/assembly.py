"""From draws to the groups, diagnoses and checks of a posterior."""

import time
from collections.abc import Mapping, Sequence

import jax
import numpy as np
import xarray as xr

from hdcal.data.case import Case
from hdcal.data.priors import Prior
from hdcal.inference.checks import Check, bound_check, conflict_check, sampling_checks
from hdcal.inference.diagnostics import Convergence, diagnose_parameters, mixing
from hdcal.inference.distributions import sample_prior
from hdcal.inference.force_model.discrepancy import discrepancy_columns
from hdcal.inference.force_model.identifiability import identification_checks
from hdcal.inference.force_model.likelihood import (
    log_likelihoods,
    pointwise_log_likelihood,
)
from hdcal.inference.force_model.padding import pad_records
from hdcal.inference.force_model.problem import Problem
from hdcal.inference.force_model.serial_correlation import previous_rows
from hdcal.inference.posterior_tree import data_groups, dataset, units_in
from hdcal.inference.sample import Draws
from hdcal.inference.sampled_problem import Sampled
from hdcal.versions import versions

_PRIOR_DRAWS = 2000
# The log likelihood of every row and draw is not kept above this many numbers.
MOST_LOG_LIKELIHOODS = 8_000_000
# Units of what follows from the parameters, and of members.
_UNITS = {
    "stiffness": "N/mm",
    "damping": "N*s/mm",
    "natural_frequency": "Hz",
    "run_offset": "N",
    "specimen_deviation": "1",
    "gap_weights": "N",
}


def assemble(
    case: Case,
    priors: Mapping[str, Prior],
    problem: Sampled,
    draws: Draws,
    *,
    seed: int,
    log_likelihood: Mapping[str, np.ndarray],
    sensitivities: Mapping[str, np.ndarray],
    mixed: Mapping[str, np.ndarray],
    checks: Sequence[Check],
    observed: tuple[str, ...] = ("force",),
) -> tuple[xr.DataTree, dict[str, Convergence], tuple[Check, ...]]:
    """Return the tree, diagnoses and checks of a posterior.

    The log likelihood is by observed column, (chain, draw, row), or empty for many
    rows, of which the total is kept. Sensitivities are those of the mean reading to
    each parameter, in noise sds. The chains of `mixed`, (chain, draw) each, must have
    mixed as those of the parameters.
    """
    values = draws.values
    # Draws are compared with the priors given how the mountings differ.
    given = problem.priors_given(draws.median)
    sampled = {
        name: given[name]
        for name, prior in priors.items()
        if name in values and prior.family != "fixed"
    }
    scalars = {name: values[name] for name in sampled}
    diagnoses = diagnose_parameters(scalars, sampled)
    rng = np.random.default_rng(seed)
    prior_draws = {
        name: sample_prior(prior, name, rng, _PRIOR_DRAWS)[None]
        for name, prior in sampled.items()
    }
    units = _UNITS | {name: prior.unit for name, prior in priors.items() if prior.unit}
    units = units_in(case.units, units)
    labels = {"run_label": case.run_labels, "specimen_label": case.specimen_labels}
    if not log_likelihood:
        log_likelihood = {"total": np.asarray(log_likelihoods(problem, values))}
    groups = {
        "posterior": dataset(values, units=units, labels=labels),
        "prior": dataset(prior_draws, units=units),
        "sample_stats": dataset(draws.statistics),
        **data_groups(case.records, observed, case.units),
        "log_likelihood": dataset(log_likelihood),
    }
    checks = (
        *sampling_checks(draws, diagnoses | mixing(mixed)),
        *checks,
        conflict_check(scalars, sampled),
        bound_check(scalars, sampled),
        *identification_checks(sensitivities, given),
    )
    return xr.DataTree.from_dict(groups), diagnoses, checks


def force_log_likelihood(
    case: Case, problem: Problem, draws: Draws
) -> dict[str, np.ndarray]:
    """Return the log likelihood of each row and draw; nothing if they are many."""
    rows = len(case.records.force)
    if np.prod(draws.shape) * rows > MOST_LOG_LIKELIHOODS:
        return {}
    padded = pad_records(case.records)
    columns = discrepancy_columns(problem.discrepancy, padded)
    before = np.full(len(padded.force), -1)
    before[:rows] = previous_rows(case.records)
    pointwise = _pointwise(problem, draws.values, padded, columns, before)
    return {"force": np.asarray(pointwise)[..., :rows]}


@jax.jit
def _pointwise(problem, values, records, columns, before):
    def log_likelihood(draw):
        return pointwise_log_likelihood(problem, draw, records, columns, before)

    return jax.vmap(jax.vmap(log_likelihood))(values)


def run_settings(draws: Draws, began: float) -> dict[str, object]:
    """Return the settings known after a run that began at a `time.perf_counter`."""
    return {
        "draws": draws.shape[1],
        "target_acceptance": draws.target_acceptance,
        "versions": versions(),
        "seconds": round(time.perf_counter() - began, 3),
    }
