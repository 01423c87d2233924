"""Structure outside the library: a space of smooth functions of the covariates."""

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from hdcal.data.records import Records
from hdcal.evidence.linear_rows import LinearRows, remove_base
from hdcal.evidence.row_features import half_cycles, place_in_run, scale_to_unit

# Number of functions along one covariate, along each of two, of labels.
_ALONE, _TOGETHER, _LABELS = 16, 4, 24
# A kernel of which less than this is left beside the base model says nothing, and
# one that is this much like another says nothing new.
_LEAST, _SAME = 1e-3, 0.97


def kernel_columns(records: Records) -> dict[str, np.ndarray]:
    """Return the columns of each kernel by name, shape (j, n), before projection.

    Each covariate, each product of two, and what belongs to runs, specimens,
    directions and half cycles; functions of order k have prior sd 1/k.

    Args:
        records: rows, run after run.
    """
    alone = _alone(records)
    labels = _labels(records)
    found = {name: _weighted(table, _ALONE) for name, table in alone.items()}
    found |= labels
    low = {name: _weighted(table, _TOGETHER) for name, table in alone.items()}
    low |= {name: table[:_LABELS] for name, table in labels.items()}
    # A stiffness that varies with anything.
    rise = records.deformation / np.max(np.abs(records.deformation))
    found |= {
        f"{name} × slope": rise * table[:_LABELS]
        for name, table in ({n: found[n] for n in alone} | labels).items()
        if name != "deformation"
    }
    for one, other in combinations(low, 2):
        if one in labels and other in labels:
            continue
        product = low[one][:, None] * low[other][None]
        found[f"{one} × {other}"] = product.reshape(-1, len(records.force))
    return found


def _weighted(table: np.ndarray, count: int) -> np.ndarray:
    return table[:count] / np.arange(1, min(count, len(table)) + 1)[:, None]


def _alone(records: Records) -> dict[str, np.ndarray]:
    def cosines(x):
        order = np.arange(1, _ALONE + 1)[:, None]
        return np.cos(np.pi * order * (x + 1.0) / 2.0)

    found = {"deformation": cosines(scale_to_unit(records.deformation))}
    levels = len(np.unique(np.round(records.temperature, 1)))
    if "temperature" in records.known and levels > 1:
        table = cosines(scale_to_unit(records.temperature))
        found["temperature"] = table[: max(1, levels - 1)]
    if "rates" in records.known:
        # With its sign: what drags on loading pulls on unloading.
        speed = np.asarray(records.rate)
        levels = len(np.unique(np.round(speed / np.max(np.abs(speed)), 2)))
        found["rate"] = cosines(scale_to_unit(speed))[: max(1, levels - 1)]
    found["order in run"] = cosines(place_in_run(records.run))
    if len(np.unique(records.run)) > 1:
        found["order"] = cosines(np.linspace(-1.0, 1.0, len(records.force)))
    if "angle" in records.known:
        turns = np.arange(1, _ALONE // 2 + 1)[:, None] * records.angle
        found["angle"] = np.stack([np.cos(turns), np.sin(turns)], axis=1).reshape(
            -1, len(records.angle)
        )
    return found


def _labels(records: Records) -> dict[str, np.ndarray]:
    found = {}
    if "unloading" in records.known:
        found["direction"] = np.asarray(records.sense, float)[None]
    for name, index in (("run", records.run), ("specimen", records.specimen)):
        members = np.unique(index)
        if 1 < len(members) <= _LABELS:
            found[name] = (np.asarray(index) == members[:, None]).astype(float)
    halves = half_cycles(records)
    members = np.unique(halves)
    if len(found.get("run", ())) < len(members) <= _LABELS and len(members) > 2:
        found["half cycle"] = (halves == members[:, None]).astype(float)
    return found


def visible_kernels(
    rows: LinearRows, tables: Mapping[str, np.ndarray], width: int
) -> tuple[tuple[str, ...], np.ndarray]:
    """Return the kernels that the base model leaves, scaled to unit mean square.

    Args:
        rows: the data.
        tables: columns of each kernel by name, shape (j, n).
        width: number of columns to which each kernel is cut or padded.

    Returns:
        Names, and columns of shape (b, width, n).
    """
    names, found = [], []
    for name, table in tables.items():
        left = remove_base(rows, table)
        size = np.sqrt(np.sum(np.mean(left**2, axis=1)))
        if size <= _LEAST * np.sqrt(np.sum(np.mean(table**2, axis=1))):
            continue
        names.append(name)
        found.append(principal(left / size, width))
    if not found:
        return (), np.zeros((0, width, 0))
    columns = np.stack(found)
    kept = _distinct(columns)
    return tuple(names[i] for i in kept), columns[kept]


def _distinct(columns: np.ndarray) -> np.ndarray:
    """Return the kernels that are not nearly the covariance of one before them.

    Likeness is the cosine between covariance matrices, from products of columns.
    """
    count, width, rows = columns.shape
    flat = columns.reshape(-1, rows)
    inner = (flat @ flat.T) ** 2
    inner = inner.reshape(count, width, count, width).sum(axis=(1, 3))
    size = np.sqrt(np.diag(inner))
    alike = inner / np.outer(size, size) > _SAME
    kept: list[int] = []
    for index in range(count):
        if not alike[index, kept].any():
            kept.append(index)
    return np.array(kept)


def principal(table: np.ndarray, width: int) -> np.ndarray:
    """Return at most `width` columns with (nearly) the same Gram matrix, padded."""
    rows = table.shape[1]
    if len(table) > width:
        # The largest directions; the Gram matrix is small, the table need not be.
        _, rotation = np.linalg.eigh(table @ table.T)
        table = rotation[:, -width:].T @ table
    return np.concatenate([table, np.zeros((width - len(table), rows))])
