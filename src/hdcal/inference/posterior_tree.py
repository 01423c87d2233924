"""Draws and data as the groups of an xarray DataTree, with ArviZ' names and axes."""

from collections.abc import Iterable, Mapping

import numpy as np
import xarray as xr

from hdcal.data.records import Records

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
        attributes = {"units": units[name]} if name in units else {}
        variables[name] = (axes, np.asarray(values), attributes)
    group = xr.Dataset(variables)
    places = {axis: np.arange(group.sizes[axis]) for axis in sample if axis != "row"}
    places |= {axis: list(each) for axis, each in (labels or {}).items()}
    return group.assign_coords({n: v for n, v in places.items() if n in group.sizes})


def data_groups(
    records: Records, observed: tuple[str, ...] = ("force",)
) -> dict[str, xr.Dataset]:
    """Return the groups of the rows: what the model explains, and the other columns."""
    columns = {name: np.asarray(getattr(records, name)) for name in COVARIATES}
    explained = {name: np.asarray(getattr(records, name)) for name in observed}
    return {
        "observed_data": dataset(explained, OVER_ROWS, units=_OBSERVED),
        "constant_data": dataset(columns, OVER_ROWS, units=COVARIATES),
    }


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
