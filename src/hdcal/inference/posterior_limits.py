"""Posterior files from strangers: refused by what they declare, before it is read."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import h5py
import numpy as np
from h5py import h5o  # pyright: ignore[reportAttributeAccessIssue]

from hdcal.data.plausible import implausible
from hdcal.data.regular_file import why_not_readable
from hdcal.data.units import COLUMN_UNITS
from hdcal.errors import Finding, InputError
from hdcal.inference.array_tree import CHAIN, DRAW, OVER_DRAWS, Group

LARGEST_FILE = 1 << 32
# What a file may unpack to: this many times its size, but at least so many bytes.
_MOST_UNPACKED, _LEAST_LIMIT = 16, 64 << 20
_LARGEST_CHUNK = 64 << 20
_MOST_OBJECTS, _MOST_ATTRIBUTES, _MOST_TEXTS = 2_000, 500, 20_000
_MOST_LETTERS = 64 << 20
# How NetCDF names what HDF5 itself needs; they hold references: the scale of each axis,
# and the data that use a scale.
_SCALES, _USERS = "DIMENSION_LIST", "REFERENCE_LIST"


def check_container(path: Path) -> None:
    """Refuse a file whose declared content is no posterior's or does not fit.

    Only declarations are read, and texts as long as they stay short.

    Raises:
        InputError: links, loops, other types, or more data than a file of its size
            can hold.
        OSError: it is missing or no HDF5 file.
    """
    if (why := why_not_readable(path, LARGEST_FILE)) is not None:
        raise InputError([Finding(str(path), *why)])
    limit = max(_MOST_UNPACKED * path.stat().st_size, _LEAST_LIMIT)
    with h5py.File(path, "r") as file:
        try:
            size = letters = 0
            for found in _objects(file):
                for more, texts in _declared(found):
                    size, letters = size + more, letters + texts
                    if letters > _MOST_LETTERS:
                        raise ValueError("holds texts of an absurd length")
        except (KeyError, TypeError, ValueError, RuntimeError) as error:
            raise _refusal(path, str(error) or "holds what no posterior does") from None
    if size > limit:
        words = f"declares {size >> 20} MiB of data, more than its size can hold"
        raise _refusal(path, words)


def read_text(path: Path, name: str) -> str:
    """Return what one attribute of a file as a whole says, the rest unread.

    Raises:
        InputError, OSError, KeyError, TypeError, ValueError, RuntimeError: the file or
            the attribute is none, or not of a posterior.
    """
    if (why := why_not_readable(path, LARGEST_FILE)) is not None:
        raise InputError([Finding(str(path), *why)])
    with h5py.File(path, "r") as file:
        _attribute(file, name)
        return str(file.attrs[name])


def _objects(file: h5py.File) -> Iterator[h5py.Group | h5py.Dataset]:
    """Yield every group and dataset once.

    Raises:
        ValueError: a link leads elsewhere or back, or there are too many objects.
    """
    waiting: list[h5py.Group] = [file]
    seen = {h5o.get_info(file.id).addr}
    while waiting:
        group = waiting.pop()
        yield group
        for name in group:
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                raise ValueError("holds a link to another place")
            found = group[name]
            if not isinstance(found, h5py.Group | h5py.Dataset):
                raise ValueError("holds what is neither group nor data")
            address = h5o.get_info(found.id).addr
            if address in seen:
                raise ValueError("holds a loop of links")
            seen.add(address)
            if len(seen) > _MOST_OBJECTS:
                raise ValueError(f"holds more than {_MOST_OBJECTS} objects")
            if isinstance(found, h5py.Group):
                waiting.append(found)
            else:
                yield found


def _declared(found: h5py.Group | h5py.Dataset) -> Iterator[tuple[int, int]]:
    """Yield how many bytes parts of an object unpack to, and how many letters.

    Raises:
        ValueError: a type or a chunk that no posterior has.
    """
    if len(found.attrs) > _MOST_ATTRIBUTES:
        raise ValueError(f"holds more than {_MOST_ATTRIBUTES} attributes in one place")
    for name in found.attrs:
        yield _attribute(found, name)
    if not isinstance(found, h5py.Dataset):
        return
    _check_type(found.dtype)
    if found.is_virtual or found.external:
        raise ValueError("keeps its data in another file")
    if found.id.get_create_plist().get_nfilters():
        # HDF5 unpacks a chunk to whatever its bytes make, and once for each access.
        raise ValueError("holds data that are compressed")
    chunk = np.prod(found.chunks or (0,), dtype=object)
    if chunk * found.dtype.itemsize > _LARGEST_CHUNK:
        raise ValueError("is cut into chunks of an absurd size")
    count = int(np.prod(found.shape, dtype=object))
    if found.dtype.kind != "O":
        yield count * found.dtype.itemsize, 0
        return
    if count > _MOST_TEXTS:
        raise ValueError(f"holds more than {_MOST_TEXTS} texts")
    # One by one, as many may be one and the same long one.
    for index in np.ndindex(found.shape):
        yield 0, len(found[index])


def _attribute(found: h5py.Group | h5py.Dataset, name: str) -> tuple[int, int]:
    """Return how many bytes an attribute unpacks to, and how many letters.

    Raises:
        ValueError: it is none that a posterior has.
    """
    held = found.attrs.get_id(name)
    count = int(np.prod(held.shape, dtype=object))
    if count > _MOST_TEXTS:
        raise ValueError(f"holds more than {_MOST_TEXTS} values in an attribute")
    if name == _SCALES:
        _check_scales(found, held)
    elif name == _USERS:
        _check_users(held.dtype)
    else:
        _check_type(held.dtype)
        if held.dtype.kind == "O":
            # HDF5 would read all of them at once, and each may be the same long one.
            if count > 1:
                raise ValueError("holds a list of texts in an attribute")
            return 0, len(str(found.attrs[name]))
    return count * held.dtype.itemsize, 0


def _check_type(dtype: np.dtype) -> None:
    text = h5py.check_string_dtype(dtype) is not None
    if dtype.kind not in "biuf" and not text:
        raise ValueError("holds data of a type that no posterior has")


def _check_scales(found: h5py.Group | h5py.Dataset, held) -> None:
    """Check that each axis of data has one scale."""
    kind = h5py.check_vlen_dtype(held.dtype)
    axes = (found.ndim,) if isinstance(found, h5py.Dataset) else ()
    if kind is None or h5py.check_ref_dtype(kind) is None or held.shape != axes:
        raise ValueError("holds axes of a type that no posterior has")
    if any(len(scales) != 1 for scales in np.asarray(found.attrs[_SCALES])):
        raise ValueError("holds several scales for one axis")


def _check_users(dtype: np.dtype) -> None:
    kinds = [dtype[name] for name in dtype.names or ()]
    if len(kinds) != 2 or h5py.check_ref_dtype(kinds[0]) is None:
        raise ValueError("holds a scale of a type that no posterior has")
    _check_type(kinds[1])


def check_draws(draws: Group, sites: Mapping[str, tuple[int, ...]]) -> None:
    """Check that draws are whole, whoever wrote them.

    Args:
        draws: the group posterior, as it was read.
        sites: shape of each parameter that the model has.

    Raises:
        KeyError, ValueError: they are not.
    """
    size = len(draws[CHAIN].values), len(draws[DRAW].values)
    if min(size) < 1:
        raise ValueError("there are no draws")
    labels = {n for n, one in draws.items() if one.values.dtype.kind in "OTU"}
    numbers = {n for n, one in draws.items() if one.axes != (n,)} - labels
    for name in {*sites, *numbers}:
        axes, values, _ = draws[name]
        if axes[:2] != OVER_DRAWS:
            raise ValueError(f"{name} has other axes")
        if name in sites and values.shape != (*size, *sites[name]):
            raise ValueError(f"{name} has another shape")
        if values.dtype.kind not in "biuf" or not np.isfinite(values).all():
            raise ValueError(f"{name} is not finite")
        # The widest range there is: chains that failed go far.
        if implausible(name, values, "effect"):
            raise ValueError(f"{name} is beyond every rig")


def check_rows(rows: Mapping[str, np.ndarray], runs: int, specimens: int) -> None:
    """Check that rows are whole and that their labels exist.

    Raises:
        ValueError: they are not.
    """
    for name, column in rows.items():
        if column.shape != rows["force"].shape or column.ndim != 1 or not column.size:
            raise ValueError(f"{name} has another shape")
        if column.dtype.kind not in "biuf" or not np.isfinite(column).all():
            raise ValueError(f"{name} is not finite")
        if name in COLUMN_UNITS and implausible(name, [column.min(), column.max()]):
            raise ValueError(f"{name} is beyond every rig")
    if np.ptp(rows["deformation"]) == 0.0:
        raise ValueError("nothing was deformed")
    for name, count in (("run", runs), ("specimen", specimens)):
        index = rows[name]
        if index.dtype.kind not in "iu" or index.min() < 0 or index.max() >= count:
            raise ValueError(f"{name} is no index of a label")


def _refusal(path: Path, words: str) -> InputError:
    remedy = "Take a file that hdcal wrote, or calibrate again"
    return InputError([Finding(str(path), words, remedy)])
