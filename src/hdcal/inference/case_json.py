"""A case as the JSON attribute of a posterior file, and back."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from math import isnan, nan
from typing import Any

import numpy as np
import xarray as xr

from hdcal.data.case import Case, Gear
from hdcal.data.full_scale import FullScale
from hdcal.data.priors import Prior
from hdcal.data.records import Geometry, Records
from hdcal.inference.posterior_tree import COVARIATES, group_of
from hdcal.quantities import BY_LOAD, FORCE

_ABOUT = (
    *("name", "run_labels", "specimen_labels", "data_sha256", "notes"),
    *("excluded", "excluded_sense"),
)


def to_json(plain: Any) -> str:
    """Return plain data as JSON; numbers may be arrays, dates become text."""
    return json.dumps(
        plain, default=lambda x: float(x) if hasattr(x, "__float__") else str(x)
    )


def restore_priors(held: Mapping[str, Mapping]) -> dict[str, Prior]:
    """Return priors that were described by `asdict`."""
    return {
        name: Prior(**{**one, "numbers": tuple(one["numbers"])})
        for name, one in held.items()
    }


def describe_case(case: Case) -> str:
    """Return a case without its rows as JSON."""
    about = {name: getattr(case, name) for name in _ABOUT}
    gear = asdict(case.gear)
    sizes = gear["geometry"].items()
    gear["geometry"] = {n: None if isnan(size) else size for n, size in sizes}
    about |= {"load": case.units.load, "known": sorted(case.records.known)}
    return to_json({**about, "gear": gear})


def restore_case(text: str, tree: xr.DataTree) -> Case:
    """Return the case of a posterior.

    Args:
        text: from `describe_case`.
        tree: groups with its rows.

    Raises:
        KeyError, TypeError, ValueError: text and rows do not describe a case.
    """
    held = json.loads(text)
    gear = held["gear"]
    for table in (name for name in gear if name.endswith("priors")):
        gear[table] = restore_priors(gear[table])
    sizes = gear["geometry"].items()
    gear["geometry"] = Geometry(**{n: nan if v is None else v for n, v in sizes})
    gear["full_scale"] = FullScale(**gear["full_scale"])
    columns = group_of(tree, "constant_data")
    rows = {name: columns[name].values for name in COVARIATES}
    rows["force"] = group_of(tree, "observed_data")["force"].values
    for name, column in rows.items():
        if column.shape != (len(rows["force"]),) or not np.isfinite(column).all():
            raise ValueError(f"{name} is no column of numbers")
    for name in ("run", "specimen"):
        if rows[name].max() >= len(held[f"{name}_labels"]):
            raise ValueError(f"a {name} has no label")
    about = {name: _tuples(held[name]) for name in _ABOUT}
    records = Records(**rows, known=frozenset(held["known"]))
    units = BY_LOAD[held.get("load", FORCE.load)]
    return Case(gear=Gear(**gear), records=records, units=units, **about)


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value
