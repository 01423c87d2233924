"""The draws and all that belongs to them in ArviZ' groups, as an xarray DataTree."""

from collections.abc import Iterable, Mapping

import jax
import numpy as np
import xarray as xr

from hdcal.data.case import Case
from hdcal.data.records import Records
from hdcal.exported import jit
from hdcal.inference.density import densities, pointwise_log_likelihood
from hdcal.inference.discrepancy import discrepancy_columns
from hdcal.inference.padding import pad_records
from hdcal.inference.problem import Problem
from hdcal.inference.sample import Draws
from hdcal.inference.serial_correlation import previous_rows
from hdcal.quantities import FORCE, Quantities

# The log likelihood of every row and draw is not kept above this many numbers.
MOST_LOG_LIKELIHOODS = 8_000_000
TOTAL = "total"
OVER_DRAWS, OVER_ROWS = ("chain", "draw"), ("row",)
_AXES = {
    "run_offset": ("run_label",),
    "specimen_deviation": ("specimen_label",),
    "gap_weights": ("basis",),
    "force": OVER_ROWS,
    "deformation": OVER_ROWS,
}
# Columns of the records that are not observed.
COVARIATES = {
    "deformation": "mm",
    "temperature": "degC",
    "time": "s",
    "angle": "rad",
    "direction": "1",
    "sense": "1",
    "rate": "mm/s",
    "run": "1",
    "specimen": "1",
    "force_sd": "N",
}
_OBSERVED = {"force": "N", "deformation": "mm"}
# What follows from the parameters, and what has no prior of its own.
_DERIVED = {
    "stiffness": "N/mm",
    "damping": "N*s/mm",
    "natural_frequency": "Hz",
    "run_offset": "N",
    "specimen_deviation": "1",
    "gap_weights": "N",
}


def build_tree(
    case: Case,
    draws: Draws,
    prior_draws: Mapping[str, np.ndarray],
    units: Mapping[str, str],
    log_likelihood: Mapping[str, np.ndarray],
    observed: tuple[str, ...] = ("force",),
) -> xr.DataTree:
    """Return the groups of a calibration.

    Args:
        case: data and gear.
        draws: from the sampler.
        prior_draws: by parameter, each (draw,).
        units: of the parameters.
        log_likelihood: by observed column, (chain, draw, row), or the total of all
            rows under `TOTAL`, (chain, draw).
        observed: columns of the records that the model explains.
    """
    units = _in(case.units, {**_DERIVED, **units})
    labels = {"run_label": case.run_labels, "specimen_label": case.specimen_labels}
    groups = {
        "posterior": dataset(draws.values, units=units, labels=labels),
        "prior": dataset({n: v[None] for n, v in prior_draws.items()}, units=units),
        "sample_stats": dataset(_sampler_statistics(draws)),
        **data_groups(case.records, observed, case.units),
        "log_likelihood": dataset(log_likelihood),
    }
    if TOTAL in log_likelihood:
        size = log_likelihood[TOTAL].size * len(case.records.force)
        groups["log_likelihood"][TOTAL].attrs["comment"] = (
            f"{size} values by row and draw are not kept; this is the log likelihood "
            "of all rows, runs, specimens and gap integrated out where they were"
        )
    return xr.DataTree.from_dict(groups)


def dataset(
    arrays: Mapping[str, np.ndarray],
    sample: tuple[str, ...] = OVER_DRAWS,
    *,
    units: Mapping[str, str] | None = None,
    labels: Mapping[str, Iterable[str]] | None = None,
) -> xr.Dataset:
    """Return arrays as a group, with their axes and units.

    Args:
        arrays: by name.
        sample: their first axes.
        units: by name, of those that have one.
        labels: of the places along an axis; chains and draws are numbered.
    """
    units, variables = units or {}, {}
    for name, values in arrays.items():
        axes = (*sample, *_AXES.get(name, ()))[: np.ndim(values)]
        about = {"units": units[name]} if name in units else {}
        variables[name] = (axes, np.asarray(values), about)
    found = xr.Dataset(variables)
    places = {axis: np.arange(found.sizes[axis]) for axis in sample if axis != "row"}
    places |= {axis: list(each) for axis, each in (labels or {}).items()}
    return found.assign_coords({n: v for n, v in places.items() if n in found.sizes})


def data_groups(
    records: Records,
    observed: tuple[str, ...] = ("force",),
    units: Quantities = FORCE,
) -> dict[str, xr.Dataset]:
    """Return the groups of the rows: what the model explains, and the other columns."""
    columns = {name: np.asarray(getattr(records, name)) for name in COVARIATES}
    explained = {name: np.asarray(getattr(records, name)) for name in observed}
    return {
        "observed_data": dataset(explained, OVER_ROWS, units=_in(units, _OBSERVED)),
        "constant_data": dataset(columns, OVER_ROWS, units=_in(units, COVARIATES)),
    }


def _in(units: Quantities, codes: Mapping[str, str]) -> dict[str, str]:
    return {name: units.unit(code) for name, code in codes.items()}


def group_of(tree: xr.DataTree, name: str) -> xr.Dataset:
    """Return a group of a tree.

    Raises:
        KeyError: there is none.
    """
    return tree.children[name].to_dataset(inherit=False)


def joined_draws(tree: xr.DataTree) -> dict[str, np.ndarray]:
    """Return all draws of the posterior by site, chains joined: [draw, …]."""
    return {
        str(name): one.values.reshape(-1, *one.shape[2:])
        for name, one in group_of(tree, "posterior").data_vars.items()
    }


def force_log_likelihood(
    case: Case, problem: Problem, draws: Draws
) -> dict[str, np.ndarray]:
    """Return the log likelihood of each row and draw, or the totals if they are many.

    Args:
        case: data and gear.
        problem: what was sampled.
        draws: from the sampler.
    """
    rows = len(case.records.force)
    if draws.energy.size * rows > MOST_LOG_LIKELIHOODS:
        return {TOTAL: densities(problem, draws.values)[1]}
    padded = pad_records(case.records)
    columns = discrepancy_columns(problem.discrepancy, padded)
    before = np.full(len(padded.force), -1)
    before[:rows] = previous_rows(case.records)
    each = _pointwise(problem, draws.values, padded, columns, before)
    return {"force": np.asarray(each)[..., :rows]}


@jit
def _pointwise(problem, values, records, columns, before):
    def one(value):
        return pointwise_log_likelihood(problem, value, records, columns, before)

    return jax.vmap(jax.vmap(one))(values)


def _sampler_statistics(draws: Draws) -> dict[str, np.ndarray]:
    """Return the statistics of the sampler under ArviZ' names, (chain, draw) each."""
    return {
        "energy": draws.energy,
        "lp": -draws.potential,
        "diverging": draws.diverging,
        "n_steps": draws.n_steps,
        "tree_depth": np.ceil(np.log2(draws.n_steps + 1)).astype(int),
        "acceptance_rate": draws.acceptance,
        "step_size": draws.step_size,
    }
