"""A posterior as a DataTree: draws and data as ArviZ' groups, the case as JSON."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from math import isnan, nan
from typing import Any

import numpy as np
import xarray as xr

from hdcal.data.case import Case, Gear
from hdcal.data.prior import FullScale
from hdcal.data.priors import Prior
from hdcal.data.records import Geometry, Records
from hdcal.quantities import BY_LOAD, FORCE, Quantities

OVER_DRAWS, OVER_ROWS = ("chain", "draw"), ("row",)
_AXES = {
    "run_offset": ("run_label",),
    "specimen_deviation": ("specimen_label",),
    "gap_weights": ("basis",),
    "force": OVER_ROWS,
    "deformation": OVER_ROWS,
}
# Columns of the records that are not observed.
_COVARIATES = {
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
# Fields of a case that its JSON holds as they are.
_FIELDS = ("name", "run_labels", "specimen_labels", "data_sha256", "notes")
_FIELDS += ("excluded", "excluded_sense")


def dataset(
    arrays: Mapping[str, np.ndarray],
    sample: tuple[str, ...] = OVER_DRAWS,
    *,
    units: Mapping[str, str] | None = None,
    labels: Mapping[str, Iterable[str]] | None = None,
) -> xr.Dataset:
    """Return arrays by name as a group, with their axes, units and labels.

    `sample` are the first axes; chains and draws are numbered.
    """
    units = units or {}
    group = xr.Dataset(
        {
            name: (
                (*sample, *_AXES.get(name, ()))[: np.ndim(values)],
                np.asarray(values),
                {"units": units[name]} if name in units else {},
            )
            for name, values in arrays.items()
        }
    )
    coords = {axis: np.arange(group.sizes[axis]) for axis in sample if axis != "row"}
    coords |= {axis: list(each) for axis, each in (labels or {}).items()}
    return group.assign_coords({n: v for n, v in coords.items() if n in group.sizes})


def data_groups(
    records: Records,
    observed: tuple[str, ...] = ("force",),
    units: Quantities = FORCE,
) -> dict[str, xr.Dataset]:
    """Return the groups of the rows: what the model explains, and the other columns."""
    codes = units_in(units, {**_COVARIATES, "force": "N"})

    def group(names: Iterable[str]) -> xr.Dataset:
        columns = {name: np.asarray(getattr(records, name)) for name in names}
        return dataset(columns, OVER_ROWS, units=codes)

    return {"observed_data": group(observed), "constant_data": group(_COVARIATES)}


def units_in(units: Quantities, codes: Mapping[str, str]) -> dict[str, str]:
    """Return units that are written in N and mm as those of what was measured."""
    return {name: units.unit(code) for name, code in codes.items()}


def group_of(tree: xr.DataTree, name: str) -> xr.Dataset:
    """Return a group of a tree; `KeyError` if there is none."""
    return tree.children[name].to_dataset(inherit=False)


def joined_draws(tree: xr.DataTree) -> dict[str, np.ndarray]:
    """Return all draws of the posterior by site, chains joined: [draw, …]."""
    return {
        str(name): draws.values.reshape(-1, *draws.shape[2:])
        for name, draws in group_of(tree, "posterior").data_vars.items()
    }


def to_json(plain: Any) -> str:
    """Return plain data as JSON; numbers may be arrays, dates become text."""
    return json.dumps(
        plain, default=lambda x: float(x) if hasattr(x, "__float__") else str(x)
    )


def restore_priors(held: Mapping[str, Mapping]) -> dict[str, Prior]:
    """Return priors from the dictionaries that `asdict` makes."""
    return {
        name: Prior(**{**fields, "numbers": tuple(fields["numbers"])})
        for name, fields in held.items()
    }


def describe_case(case: Case) -> str:
    """Return a case without its rows as JSON."""
    gear = asdict(case.gear)
    sizes = gear["geometry"].items()
    # Sizes of a spring are NaN, which is no number of JSON.
    gear["geometry"] = {n: None if isnan(size) else size for n, size in sizes}
    fields = {name: getattr(case, name) for name in _FIELDS}
    fields |= {"load": case.units.load, "known": sorted(case.records.known)}
    return to_json({**fields, "gear": gear})


def restore_case(text: str, tree: xr.DataTree) -> Case:
    """Return the case of a posterior.

    `KeyError`, `TypeError` or `ValueError` if text and rows do not describe a case.
    """
    fields = json.loads(text)
    gear = fields["gear"]
    for table in (name for name in gear if name.endswith("priors")):
        gear[table] = restore_priors(gear[table])
    sizes = gear["geometry"].items()
    gear["geometry"] = Geometry(**{n: nan if v is None else v for n, v in sizes})
    gear["full_scale"] = FullScale(**gear["full_scale"])
    columns = group_of(tree, "constant_data")
    rows = {name: columns[name].values for name in _COVARIATES}
    rows["force"] = group_of(tree, "observed_data")["force"].values
    return Case(
        gear=Gear(**gear),
        records=Records(**rows, known=frozenset(fields["known"])),
        units=BY_LOAD[fields["load"]],
        **{name: _tuples(fields[name]) for name in _FIELDS},
    )


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value
