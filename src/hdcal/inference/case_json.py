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

_TABLES = (
    "priors",
    "scale_priors",
    "effect_priors",
    "dynamic_priors",
    "gauge_priors",
)


def describe_prior(prior: Prior) -> dict[str, Any]:
    """Return a prior as plain data."""
    return asdict(prior) | {"numbers": [float(number) for number in prior.numbers]}


def restore_priors(held: Mapping[str, Mapping]) -> dict[str, Prior]:
    """Return priors that `describe_prior` described."""
    return {
        name: Prior(**{**one, "numbers": tuple(one["numbers"])})
        for name, one in held.items()
    }


def describe_case(case: Case) -> str:
    """Return a case without its rows as JSON."""
    gear = asdict(case.gear)
    sizes = {name: float(size) for name, size in gear["geometry"].items()}
    gear["geometry"] = {n: None if isnan(size) else size for n, size in sizes.items()}
    for table in _TABLES:
        priors = getattr(case.gear, table)
        gear[table] = {name: describe_prior(p) for name, p in priors.items()}
    return json.dumps(
        {
            "name": case.name,
            "gear": gear,
            "known": sorted(case.records.known),
            "run_labels": case.run_labels,
            "specimen_labels": case.specimen_labels,
            "data_sha256": case.data_sha256,
            "notes": case.notes,
        },
        # Dates of the gear file.
        default=str,
    )


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
    for table in _TABLES:
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
    return Case(
        name=held["name"],
        gear=Gear(**gear),
        records=Records(**rows, known=frozenset(held["known"])),
        run_labels=tuple(held["run_labels"]),
        specimen_labels=tuple(held["specimen_labels"]),
        data_sha256=held["data_sha256"],
        notes=tuple(held["notes"]),
    )
