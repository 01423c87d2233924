"""Arrays with named axes in named groups, and the NetCDF file that holds them.

It is the tree that ArviZ draws from. xarray makes it too, in twenty times the time, and
importing that takes longer than to read and to predict: it is there for who asks.
"""

import io
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import h5py
import numpy as np

if TYPE_CHECKING:
    import xarray as xr

# What NetCDF says of an array that is read back; the rest is how it is stored.
_SAID = ("units", "long_name", "comment")
_TYPE, _LABELS = "dtype", "coordinates"
# All that arrays are said to be; the rest of it is of HDF5 and NetCDF.
_KNOWN = {*_SAID, _TYPE, _LABELS, "_FillValue", "_Netcdf4Dimid", "_Netcdf4Coordinates"}
_KNOWN |= {"CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST"}
CHAIN, DRAW = "chain", "draw"
OVER_DRAWS = (CHAIN, DRAW)


class Named(NamedTuple):
    """An array with the names of its axes.

    Attributes:
        axes: their names.
        values: the array.
        said: what NetCDF says of it: units, long_name, comment.
    """

    axes: tuple[str, ...]
    values: np.ndarray
    said: Mapping[str, str] = {}

    def taken(self, axis: str, places) -> "Named":
        """Return it with these places of an axis, or as it is where it has none."""
        if axis not in self.axes:
            return self
        kept = np.take(self.values, places, axis=self.axes.index(axis))
        return self._replace(values=kept)


# Arrays by name; what stands along an axis has the name of the axis.
Group = Mapping[str, Named]


@dataclass(frozen=True)
class ArrayTree:
    """Groups of arrays, each group with axes of its own.

    Attributes:
        groups: by name.
        attrs: texts about all of them.
    """

    groups: Mapping[str, Group]
    attrs: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def datatree(self) -> "xr.DataTree":
        """The same as xarray's DataTree, for ArviZ."""
        import xarray as xr

        tree = xr.DataTree.from_dict(
            {
                name: xr.Dataset({**group}).set_coords(_labels(group))
                for name, group in self.groups.items()
            }
        )
        tree.attrs = {**self.attrs}
        return tree

    def content(self) -> bytes:
        """Return the NetCDF file.

        Made in memory: HDF5 crashes where a disk that is full refuses its writes.
        """
        content = io.BytesIO()
        with h5py.File(content, "w", track_order=True) as file:
            file.attrs.update(self.attrs)
            for name, group in self.groups.items():
                _write(file.create_group(name, track_order=True), group)
        return content.getvalue()


def group_of(
    arrays: Mapping[str, np.ndarray],
    sample: tuple[str, ...] = OVER_DRAWS,
    axes: Mapping[str, tuple[str, ...]] | None = None,
    labels: Mapping[str, Iterable] | None = None,
) -> dict[str, Named]:
    """Return arrays as ArviZ has them in a group.

    Args:
        arrays: by name.
        sample: their first axes.
        axes: the others by array; they are called after it where nothing is said.
        labels: by axis; places are numbered where nothing is said.
    """
    axes, labels, found = axes or {}, labels or {}, {}
    for name, array in arrays.items():
        values = np.asarray(array)
        inner = range(values.ndim - len(sample))
        own = axes.get(name) or [f"{name}_dim_{place}" for place in inner]
        found[name] = Named((*sample, *own), values)
    sizes = [zip(one.axes, one.values.shape, strict=True) for one in found.values()]
    for axis, size in dict(pair for each in sizes for pair in each).items():
        along = labels.get(axis, range(size))
        found[axis] = Named((axis,), np.asarray([*along]))
    return found


def joined(group: Group) -> dict[str, np.ndarray]:
    """Return all draws by site, chains joined: [draw, …]."""
    drawn = {n: one.values for n, one in group.items() if one.axes[:2] == OVER_DRAWS}
    return {n: values.reshape(-1, *values.shape[2:]) for n, values in drawn.items()}


def read(path: Path | str) -> ArrayTree:
    """Return the content of a NetCDF file of such groups.

    Raises:
        OSError: there is none.
        Exception: the file holds something else.
    """
    with h5py.File(path, "r") as file:
        groups = {name: _read(node) for name, node in file.items()}
        # What begins so is of NetCDF itself.
        own = [name for name in file.attrs if not name.startswith("_")]
        attrs = {name: str(file.attrs[name]) for name in own}
    return ArrayTree(groups, attrs)


def _read(node: h5py.Group) -> Group:
    group = {name: _named(name, held) for name, held in node.items()}
    for one in group.values():
        for axis, size in zip(one.axes, one.values.shape, strict=True):
            along = group[axis]
            if along.axes != (axis,) or along.values.shape != (size,):
                raise ValueError(f"{axis} has several sizes")
    return group


def _named(name: str, held: h5py.Dataset) -> Named:
    scales = [] if held.is_scale else [scale[0] for scale in held.dims]
    if any(scale.parent != held.parent for scale in scales):
        raise ValueError(f"{name} has the axis of another group")
    last = [str(scale.name).rpartition("/")[2] for scale in scales]
    axes = (name,) if held.is_scale else last
    text = h5py.check_string_dtype(held.dtype) is not None
    values = np.asarray(held.asstr()[...] if text else held[...])
    # As this machine has it, for JAX.
    values = values.astype(values.dtype.newbyteorder("="), copy=False)
    _check_attributes(name, held)
    if held.attrs.get(_TYPE) == "bool":
        values = values.astype(bool)
    said = {key: str(held.attrs[key]) for key in _SAID if key in held.attrs}
    return Named((*axes,), values, said)


def _check_attributes(name: str, held: h5py.Dataset) -> None:
    """Refuse what makes others read other numbers: no digest would tell."""
    fill = held.attrs.get("_FillValue")
    scaled = {*held.attrs} - _KNOWN or (fill is not None and not np.all(fill != fill))
    if scaled or "since" in str(held.attrs.get("units", "")):
        raise ValueError(f"{name} is scaled, or has gaps")


def _write(node: h5py.Group, group: Group) -> None:
    made = {}
    for name, one in group.items():
        made[name] = node.create_dataset(name, **_storable(one.values))
        made[name].attrs.update(one.said)
        if one.values.dtype.kind == "b":
            made[name].attrs[_TYPE] = "bool"
        if one.axes == (name,):
            made[name].make_scale(name)
    for name, one in group.items():
        if one.axes != (name,):
            for place, axis in enumerate(one.axes):
                made[name].dims[place].attach_scale(made[axis])
    if labels := _labels(group):
        node.attrs[_LABELS] = " ".join(labels)


def _labels(group: Group) -> list[str]:
    """Return what labels the places of an axis that has numbers already."""
    text = [name for name, one in group.items() if one.values.dtype.kind in "OTU"]
    return [name for name in text if group[name].axes != (name,)]


def _storable(values: np.ndarray) -> dict:
    """Return numbers and texts as NetCDF knows them; it has no truth values."""
    if values.dtype.kind == "b":
        return {"data": values.astype(np.int8)}
    if values.dtype.kind in "OTU":
        return {"data": values.astype(object), "dtype": h5py.string_dtype()}
    return {"data": values}
