"""A case as part of a posterior file, and back."""

import json
from dataclasses import fields

import numpy as np
import xarray as xr

from hdcal.errors import Finding, InputError
from hdcal.rig.case import Case, Gear
from hdcal.rig.priors import Prior
from hdcal.rig.records import Geometry, Records

UNITS = {
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


def covariates(records: Records) -> dict[str, np.ndarray]:
    """Return every column of the records but the force."""
    return {name: np.asarray(getattr(records, name)) for name in UNITS}


def describe_prior(prior: Prior) -> dict:
    """Return a prior as plain data."""
    numbers = [float(number) for number in prior.numbers]
    return {
        "family": prior.family,
        "numbers": numbers,
        "unit": prior.unit,
        "source": prior.source,
    }


def restore_prior(plain: dict) -> Prior:
    """Return the prior that `describe_prior` described."""
    return Prior(
        plain["family"], tuple(plain["numbers"]), plain["unit"], plain["source"]
    )


_TABLES = ("priors", "scale_priors", "effect_priors", "dynamic_priors")


def describe_case(case: Case) -> str:
    """Return everything of a case but its rows, as JSON."""
    gear = {f.name: getattr(case.gear, f.name) for f in fields(Gear)}
    geometry = {
        f.name: float(getattr(gear["geometry"], f.name)) for f in fields(Geometry)
    }
    for table in _TABLES:
        gear[table] = {name: describe_prior(p) for name, p in gear[table].items()}
    return json.dumps(
        {
            "name": case.name,
            "gear": {**gear, "geometry": geometry},
            "known": sorted(case.records.known),
            "run_labels": case.run_labels,
            "specimen_labels": case.specimen_labels,
            "data_sha256": case.data_sha256,
            "notes": case.notes,
        },
        default=str,
    )


def restore_case(text: str, constant: xr.Dataset, force: xr.DataArray) -> Case:
    """Return the case that was described, with its rows.

    Raises:
        KeyError, ValueError: the description is not one.
    """
    plain = json.loads(text)
    gear = plain["gear"]
    # A file of before there were dynamics is as good as ever for the rest.
    gear.setdefault("dynamic_priors", {})
    for table in _TABLES:
        gear[table] = {name: restore_prior(p) for name, p in gear[table].items()}
    gear["geometry"] = Geometry(**gear["geometry"])
    rows = {name: constant[name].to_numpy() for name in UNITS}
    records = Records(**rows, force=force.to_numpy(), known=frozenset(plain["known"]))
    return Case(
        name=plain["name"],
        gear=Gear(**gear),
        records=records,
        run_labels=tuple(plain["run_labels"]),
        specimen_labels=tuple(plain["specimen_labels"]),
        data_sha256=plain["data_sha256"],
        notes=tuple(plain["notes"]),
    )


def open_tree(path) -> xr.DataTree:
    """Open a posterior file and read it whole.

    Raises:
        InputError: it is missing or not a posterior file.
    """
    try:
        with xr.open_datatree(path, engine="h5netcdf") as tree:
            loaded = tree.load()
    except FileNotFoundError as error:
        raise InputError(
            [
                Finding(
                    str(path),
                    "there is no such file",
                    "Name the folder that hdcal calibrate wrote",
                )
            ]
        ) from error
    except Exception as error:
        raise InputError([not_a_posterior(path)]) from error
    return loaded


def not_a_posterior(path) -> Finding:
    """Return the finding for a file that hdcal did not write."""
    return Finding(
        str(path),
        "is not a posterior that hdcal wrote, or it is damaged",
        "Calibrate again",
    )
