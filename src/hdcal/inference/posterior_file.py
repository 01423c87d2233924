"""A case as part of a posterior file, and back; a file that was changed is refused."""

import hashlib
import json
import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hdcal.data.case import Case, Gear
from hdcal.data.full_scale import FullScale
from hdcal.data.priors import Prior
from hdcal.data.records import Geometry, Records
from hdcal.data.typed_json import typed_text
from hdcal.errors import Finding, InputError
from hdcal.inference.array_tree import ArrayTree, Group, read
from hdcal.inference.held import HeldCase, HeldGear, HeldPrior
from hdcal.inference.posterior_limits import check_container, check_rows, read_text
from hdcal.inference.serial_correlation import CORRELATION


class Kind(NamedTuple):
    """What a posterior file is of.

    Attributes:
        format: name and version of its format.
        again: how it is made anew.
        elsewhere: what it is, and what to do with it, where another kind is needed.
    """

    format: str
    again: str
    elsewhere: tuple[str, str]


CALIBRATION = Kind(
    "hdcal.posterior/1",
    "calibrate again",
    ("is of a calibration, not of a fleet", "Name the folder of a fleet"),
)
FLEET = Kind(
    "hdcal.fleet-posterior/1",
    "ask for the fleet again",
    (
        "is of a fleet, which models no gear by itself",
        "The force of a gear to come is told by margin and fleet, with --deformation; "
        "lines compare as lots of one fleet, a gear is calibrated with --specimen",
    ),
)
# Answers beside which no posterior lies, and what to name instead.
_WITHOUT = {
    "hdcal.compare/1": (
        "a comparison leaves no posterior",
        "Name the folders of the results that were compared",
    ),
    "hdcal.causes/1": (
        "causes across gears leave no posterior",
        "Name the folder of a fleet, or of one gear's calibration",
    ),
    "hdcal.fleet/1": (
        "this fleet was left by an older hdcal, without a posterior",
        FLEET.again,
    ),
}
# The attributes that hold the format, and the digest of everything else.
_FORMAT, DIGEST = "hdcal_format", "sha256"

FILE_NAME = "posterior.nc"
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


def restore_priors(held: Mapping[str, HeldPrior]) -> dict[str, Prior]:
    """Return the priors that `describe_prior` described."""
    return {
        name: Prior(one.family, tuple(one.numbers), one.unit, one.source)
        for name, one in held.items()
    }


_TABLES = (
    "priors",
    "scale_priors",
    "effect_priors",
    "dynamic_priors",
    "gauge_priors",
)


def describe_case(case: Case) -> str:
    """Return everything of a case but its rows, as JSON."""
    gear = {f.name: getattr(case.gear, f.name) for f in fields(Gear)}
    read = gear["geometry"]
    sizes = {f.name: float(getattr(read, f.name)) for f in fields(Geometry)}
    geometry = {n: None if math.isnan(size) else size for n, size in sizes.items()}
    gear["full_scale"] = asdict(gear["full_scale"])
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


def restore_case(text: str, constant: Group, force: np.ndarray) -> Case:
    """Return the case that was described, with its rows.

    Raises:
        KeyError, TypeError, ValueError: the description is not one, or not of these
            rows.
    """
    held = typed_text(HeldCase, text)
    gear = {f.name: getattr(held.gear, f.name) for f in fields(HeldGear)}
    for table in _TABLES:
        gear[table] = restore_priors(gear[table])
    # A file without it is of before correlation was inferred: there was none.
    gear["scale_priors"].setdefault(CORRELATION, Prior("fixed", (0.0,), "1"))
    sizes = vars(held.gear.geometry)
    gear["geometry"] = Geometry(
        **{name: math.nan if size is None else size for name, size in sizes.items()}
    )
    gear["full_scale"] = FullScale(**vars(held.gear.full_scale))
    rows = {name: constant[name].values for name in UNITS}
    rows["force"] = force
    check_rows(rows, len(held.run_labels), len(held.specimen_labels))
    return Case(
        name=held.name,
        gear=Gear(**gear),
        records=Records(**rows, known=frozenset(held.known)),
        run_labels=tuple(held.run_labels),
        specimen_labels=tuple(held.specimen_labels),
        data_sha256=held.data_sha256,
        notes=tuple(held.notes),
    )


def open_tree(path, kind: Kind = CALIBRATION) -> ArrayTree:
    """Open a posterior file and read it whole.

    Raises:
        InputError: it is missing, not a posterior file, or declares what none holds.
    """
    try:
        check_container(Path(path))
        return read(path)
    except FileNotFoundError as error:
        none = "there is no such file", "Name the folder of a calibration"
        words, remedy = _WITHOUT.get(_kind_beside(Path(path)), none)
        raise InputError([Finding(str(path), words, remedy)]) from error
    except InputError:
        raise
    except Exception as error:
        raise InputError([not_a_posterior(path, kind)]) from error


def file_of(path: Path | str) -> Path:
    """Return the posterior file of a result folder, or the file itself."""
    path = Path(path)
    return path / FILE_NAME if path.is_dir() else path


def kind_of(path: Path | str) -> Kind | None:
    """Return what a result folder, or its posterior file, says it is of.

    None where there is no posterior file.
    """
    return _kind(told(path, _FORMAT))


def told(path: Path | str, name: str) -> str:
    """Return what an attribute of a posterior file says; nothing without the two."""
    # Why it cannot be read is told when it is read whole.
    with suppress(InputError, OSError, KeyError, TypeError, ValueError, RuntimeError):
        return read_text(file_of(path), name)
    return ""


def _kind(written: str) -> Kind | None:
    """Return of what a format is, whatever its version."""
    name = written.rpartition("/")[0]
    same = (k for k in (CALIBRATION, FLEET) if k.format.rpartition("/")[0] == name)
    return next(same, None)


def _kind_beside(path: Path) -> str:
    """Return the schema of the answer that lies beside a file; empty without one."""
    try:
        told = json.loads((path.parent / "summary.json").read_bytes())
        return str(told["schema"])
    except (OSError, ValueError, KeyError, TypeError):
        return ""


def not_a_posterior(path, kind: Kind = CALIBRATION) -> Finding:
    """Return the finding for a file that hdcal did not write."""
    words = "is not a posterior that hdcal wrote, or it is damaged"
    return Finding(str(path), words, kind.again)


def sealed(tree: ArrayTree, kind: Kind, attributes: Mapping[str, str]) -> bytes:
    """Return the content of a NetCDF file that ArviZ opens, with its digest."""
    tree = replace(tree, attrs={_FORMAT: kind.format, **attributes})
    return replace(tree, attrs={**tree.attrs, DIGEST: digest(tree)}).content()


def digest(tree: ArrayTree) -> str:
    """Return a SHA-256 of every number, label and attribute that hdcal reads back.

    It is the same before writing and after reading: groups and variables in the order
    of their names, numbers as little-endian 64 bits, labels and attributes as text.
    """
    whole = hashlib.sha256()
    for name in sorted({*tree.attrs} - {DIGEST}):
        whole.update(json.dumps([name, tree.attrs[name]]).encode())
    for place, group in sorted(tree.groups.items()):
        for name, one in sorted(group.items()):
            kind, data = _canonical(one.values)
            head = [f"/{place}", name, one.axes, kind, len(data)]
            whole.update(json.dumps(head).encode())
            whole.update(data)
    return whole.hexdigest()


def _canonical(values: np.ndarray) -> tuple[str, bytes]:
    """Return kind and bytes of an array, whatever type the file gave it."""
    if values.dtype.kind in "biuf":
        kind = "<f8" if values.dtype.kind == "f" else "<i8"
        return f"{kind}{values.shape}", np.ascontiguousarray(values, kind).tobytes()
    return f"text{values.shape}", json.dumps([str(v) for v in values.flat]).encode()


def check_unchanged(tree: ArrayTree, path, kind: Kind = CALIBRATION) -> None:
    """Refuse a posterior of another kind or version, or not as hdcal wrote it.

    The digest detects accidental changes. It is no signature: it can be computed
    anew.

    Raises:
        InputError: with what is wrong.
    """
    written = tree.attrs.get(_FORMAT, "")
    found = _kind(written)
    if found is None:
        raise InputError([not_a_posterior(path, kind)])
    if found is not kind:
        words, remedy = found.elsewhere
    elif written != kind.format:
        words = f"has the format {written}, and this hdcal reads {kind.format}"
        remedy = f"Use the hdcal that wrote it, or {kind.again}"
    elif DIGEST not in tree.attrs:
        words, remedy = "was written by an older version of hdcal", kind.again
    elif tree.attrs[DIGEST] != digest(tree):
        words = "was changed after hdcal wrote it"
        remedy = f"Take the file as it was written, or {kind.again}"
    else:
        return
    raise InputError([Finding(str(path), words, remedy)])
