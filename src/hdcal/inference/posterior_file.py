"""The NetCDF file of a posterior: format, digest, and what is refused on reading."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import xarray as xr

from hdcal.data.regular_file import why_not_readable
from hdcal.errors import Finding, InputError, NotUsable

FILE_NAME = "posterior.nc"
# Attributes that hold the format, and the digest of everything else.
FORMAT, DIGEST = "hdcal_format", "sha256"
_LARGEST_FILE = 1 << 32


@dataclass(frozen=True)
class Kind:
    """A kind of posterior file.

    Attributes:
        format: name and version of its format.
        again: how it is made anew.
        elsewhere: problem and remedy where another kind is needed.
    """

    format: str
    again: str
    elsewhere: tuple[str, str]

    @property
    def name(self) -> str:
        """Name of the format, without its version."""
        return self.format.rpartition("/")[0]


CALIBRATION = Kind(
    "hdcal.posterior/2",
    "calibrate again",
    ("is of a calibration, not of a fleet", "Name the folder of a fleet"),
)
FLEET = Kind(
    "hdcal.fleet-posterior/2",
    "run hdcal fleet again",
    (
        "is of a fleet, which models no gear by itself",
        "Ask margin or fleet with --deformation for the force of the next gear, "
        "compare lots within one fleet, calibrate a gear with --specimen",
    ),
)
# Answers without a posterior file, and what to name instead.
_WITHOUT = {
    "hdcal.compare/1": (
        "a comparison has no posterior",
        "Name the folders of the results that were compared",
    ),
    "hdcal.causes/1": (
        "causes across gears have no posterior",
        "Name the folder of a fleet, or of the calibration of one gear",
    ),
    "hdcal.verdict/2": (
        "this diagnosis holds no calibrated model",
        "Diagnose again without --quick, or calibrate",
    ),
}


def file_of(path: Path | str) -> Path:
    """Return the posterior file of a result folder, or the file itself."""
    path = Path(path)
    return path / FILE_NAME if path.is_dir() else path


def kind_of(path: Path | str) -> Kind | None:
    """Return the kind of a posterior file; None where it is no posterior file.

    Args:
        path: a result folder or its posterior file.
    """
    file = file_of(path)
    if why_not_readable(file, _LARGEST_FILE) is not None:
        return None
    try:
        with xr.open_dataset(file, engine="h5netcdf") as root:
            return _kind(root.attrs.get(FORMAT))
    except (OSError, ValueError):
        return None


def content(tree: xr.DataTree, kind: Kind, attributes: Mapping[str, str]) -> bytes:
    """Return the content of a NetCDF file.

    It is made in memory: HDF5 crashes when a full disk refuses its writes.

    Args:
        tree: the groups.
        kind: of the file.
        attributes: of the root.
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
        raise InputError([_missing(path)]) from error
    # What h5py and xarray raise for a damaged file depends on the damage.
    except Exception as error:
        raise not_a_posterior(path, kind) from error
    written = tree.attrs.get(FORMAT)
    if (found := _kind(written)) is None:
        raise not_a_posterior(path, kind)
    if found is not kind:
        problem, remedy = found.elsewhere
    elif written != kind.format:
        problem = f"has the format {written}, and this hdcal reads {kind.format}"
        remedy = f"Use the hdcal that wrote it, or {kind.again}"
    elif tree.attrs.get(DIGEST) != digest(tree):
        problem = "was changed after hdcal wrote it"
        remedy = f"Take the file as it was written, or {kind.again}"
    else:
        return tree
    raise InputError([Finding(str(path), problem, remedy)])


def digest(tree: xr.DataTree) -> str:
    """Return a SHA-256 of all arrays and group attributes.

    It detects accidental changes and is no signature.
    """
    whole = hashlib.sha256()
    for node in sorted(tree.subtree, key=lambda node: node.path):
        attributes = {n: v for n, v in node.attrs.items() if n != DIGEST}
        head = json.dumps([node.path, attributes], sort_keys=True)
        whole.update(head.encode())
        variables = node.to_dataset(inherit=False).variables
        for name in sorted(map(str, variables)):
            one, values = variables[name], variables[name].values
            whole.update(json.dumps([name, one.dims, one.shape]).encode())
            whole.update(
                values.tobytes()
                if values.dtype.kind in "biuf"
                else json.dumps(values.tolist()).encode()
            )
    return whole.hexdigest()


def not_a_posterior(path: Path, kind: Kind = CALIBRATION) -> InputError:
    """Return the error for a file that hdcal did not write."""
    problem = "is not a posterior that hdcal wrote, or it is damaged"
    return InputError([Finding(str(path), problem, kind.again)])


def _kind(written: object) -> Kind | None:
    """Return the kind of a format of any version."""
    name = str(written).rpartition("/")[0]
    return next((kind for kind in (CALIBRATION, FLEET) if kind.name == name), None)


def _missing(path: Path) -> Finding:
    """Return the finding for a missing file, by the answer beside it.

    Raises:
        NotUsable: the answer is of a diagnosis that failed.
    """
    problem, remedy = "there is no such file", "Name the folder of a calibration"
    for name in ("summary.json", "verdict.json"):
        try:
            answer = json.loads((path.parent / name).read_bytes())
            problem, remedy = _WITHOUT.get(answer["schema"], (problem, remedy))
            failed = answer["status"] == "failed"
        except (OSError, ValueError, KeyError, TypeError):
            continue
        if failed and name == "verdict.json":
            reasons = "; ".join(map(str, answer.get("reasons", ())))
            raise NotUsable(f"this diagnosis failed and must not be used: {reasons}")
    return Finding(str(path), problem, remedy)
