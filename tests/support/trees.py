"""Posteriors with other numbers in their groups, by way of xarray."""

from dataclasses import replace

import xarray as xr

from hdcal.inference.array_tree import ArrayTree, Named


def arrays_of(tree: xr.DataTree) -> ArrayTree:
    """Return what an xarray tree holds as hdcal keeps it."""
    groups = {
        name: {
            str(key): Named(tuple(map(str, one.dims)), one.values, one.attrs)
            for key, one in node.to_dataset(inherit=False).variables.items()
        }
        for name, node in tree.children.items()
    }
    return ArrayTree(groups, {str(key): str(text) for key, text in tree.attrs.items()})


def with_tree(posterior, tree: xr.DataTree):
    """Return a posterior with the groups of an xarray tree."""
    return replace(posterior, arrays=arrays_of(tree))
