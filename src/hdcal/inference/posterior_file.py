"""The NetCDF file of a posterior: format, digest, and what is refused on reading."""

import hashlib
import json
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import xarray as xr

from hdcal.data.findings import why_not_readable
from hdcal.errors import Finding, InputError, NotUsable

FILE_NAME = "posterior.nc"
# Attributes that hold the format, and the digest of everything else.
FORMAT, DIGEST = "hdcal_format", "sha256"
_LARGEST_FILE = 1 << 32


class Kind(NamedTuple):
    """Format and version of a posterior file, its content, and how to remake it."""

    format: str
    words: str
    again: str


CALIBRATION = Kind("hdcal.posterior/3", "of a calibration", "calibrate again")
FLEET = Kind("hdcal.fleet-posterior/2", "of a fleet", "run hdcal fleet again")


def file_of(path: Path | str) -> Path:
    """Return the posterior file of a result folder, or the file itself."""
    path = Path(path)
    return path / FILE_NAME if path.is_dir() else path


def content(tree: xr.DataTree, kind: Kind, attributes: Mapping[str, str]) -> bytes:
    """Return the content of a NetCDF file with these groups and root attributes.

    It is made in memory: HDF5 crashes when a full disk refuses its writes.
    """
    tree = tree.copy()
    tree.attrs = {FORMAT: kind.format, **attributes}
    tree.attrs[DIGEST] = digest(tree)
    return bytes(tree.to_netcdf(engine="h5netcdf"))


def read_tree(path: Path, kind: Kind = CALIBRATION) -> xr.DataTree:
    """Return the content of a posterior file.

    Raises:
        InputError: it is missing, damaged, changed, or of another kind or version.
        NotUsable: it belongs to a diagnosis that failed.
    """
    if (why := why_not_readable(path, _LARGEST_FILE)) is not None:
        raise InputError([Finding(str(path), *why)])
    try:
        tree = xr.load_datatree(path, engine="h5netcdf")
    except FileNotFoundError as error:
        raise _missing(path) from error
    # What h5py and xarray raise for a damaged file depends on the damage.
    except Exception as error:
        raise not_a_posterior(path, kind) from error
    format_name = tree.attrs.get(FORMAT)
    if (written := _kind(format_name)) is None:
        raise not_a_posterior(path, kind)
    if format_name != kind.format:
        problem = f"is {written.words} ({format_name}), and {kind.format} is needed"
        remedy = f"Name the result folder {kind.words}, or {kind.again}"
        if written == FLEET:
            remedy += "; hdcal fleet --deformation gives the force of a future part"
    elif tree.attrs.get(DIGEST) != digest(tree):
        problem = "was changed after hdcal wrote it"
        remedy = f"Take the file as it was written, or {kind.again}"
    else:
        return tree
    raise InputError([Finding(str(path), problem, remedy)])


def digest(tree: xr.DataTree) -> str:
    """Return a SHA-256 of all arrays and group attributes; it is no signature."""
    whole = hashlib.sha256()
    for node in sorted(tree.subtree, key=lambda node: node.path):
        attributes = {n: v for n, v in node.attrs.items() if n != DIGEST}
        whole.update(json.dumps([node.path, attributes], sort_keys=True).encode())
        variables = node.to_dataset(inherit=False).variables
        for name in sorted(map(str, variables)):
            variable, values = variables[name], variables[name].values
            whole.update(json.dumps([name, variable.dims, variable.shape]).encode())
            is_numeric = values.dtype.kind in "biuf"
            texts = b"" if is_numeric else json.dumps(values.tolist()).encode()
            whole.update(values.tobytes() if is_numeric else texts)
    return whole.hexdigest()


def not_a_posterior(path: Path, kind: Kind = CALIBRATION) -> InputError:
    """Return the error for a file that hdcal did not write."""
    problem = "is not a posterior that hdcal wrote, or it is damaged"
    return InputError([Finding(str(path), problem, kind.again)])


def _kind(written: object) -> Kind | None:
    """Return the kind of a format of any version."""
    name = str(written).rpartition("/")[0]
    kinds = CALIBRATION, FLEET
    return next((kind for kind in kinds if kind.format.startswith(f"{name}/")), None)


def _missing(path: Path) -> InputError | NotUsable:
    """Return the error for a file that is not there, as of a failed diagnosis."""
    with suppress(OSError, ValueError):
        verdict = json.loads((path.parent / "verdict.json").read_bytes())
        if verdict.get("status") == "failed":
            why = "; ".join(map(str, verdict.get("reasons", ())))
            return NotUsable(f"this diagnosis failed and must not be used: {why}")
    remedy = "Name the folder of a calibration, or of a diagnosis without --quick"
    return InputError([Finding(str(path), "there is no such file", remedy)])
