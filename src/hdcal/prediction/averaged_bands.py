"""Bands averaged over several models, each weighed by its probability."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdcal.inference.posterior import Posterior
from hdcal.prediction.bands.bands import Bands, default_bands

# Probabilities inside the bands from which each model's distribution is pieced
# together; they reach beyond the 95 % that are asked for.
_INTERVALS = (0.995, 0.98, 0.95, 0.9, 0.8, 0.6, 0.4, 0.2, 0.05)
_TARGETS = {"lo": 0.025, "median": 0.5, "hi": 0.975}
_KINDS = ("physics", "with_gap", "new_measurement")


def averaged_bands(members: Sequence[tuple[float, Posterior]]) -> Bands:
    """Return the 95 % bands of a mixture of models on the default grid.

    The distribution function of a mixture is the weighted mean of its members'.

    Args:
        members: probability and posterior of each model; the former are scaled to
            sum to 1.
    """
    if len(members) == 1:
        return default_bands(members[0][1])
    # A member whose sampler failed is left out: what remains counts as all.
    total = sum(share for share, _ in members)
    weights = [share / total for share, _ in members]
    tables = [[default_bands(each, p) for p in _INTERVALS] for _, each in members]
    first = tables[0][0]
    columns = {}
    for kind in _KINDS:
        if np.isnan([getattr(t[0], f"{kind}_median_N") for t in tables]).all():
            continue
        each = [_quantiles(table, kind) for table in tables]
        found = _mixture(each, weights)
        columns |= {f"{kind}_{end}_N": found[i] for i, end in enumerate(_TARGETS)}
    return replace(first, **columns)


def _levels() -> np.ndarray:
    half = np.array(_INTERVALS) / 2.0
    return np.concatenate([0.5 - half, [0.5], 0.5 + half[::-1]])


def _quantiles(table: Sequence[Bands], kind: str) -> np.ndarray:
    """Return the quantiles of one model at all levels, shape (levels, rows)."""

    def at(bands: Bands, end: str) -> np.ndarray:
        values = getattr(bands, f"{kind}_{end}_N")
        # A model without a leftover has none to add.
        return np.where(np.isnan(values), getattr(bands, f"physics_{end}_N"), values)

    low = [at(bands, "lo") for bands in table]
    high = [at(bands, "hi") for bands in reversed(table)]
    return np.stack([*low, at(table[0], "median"), *high])


def _mixture(each: Sequence[np.ndarray], weights: Sequence[float]) -> np.ndarray:
    """Return the target quantiles of the mixture, shape (targets, rows)."""
    levels, targets = _levels(), list(_TARGETS.values())
    rows = each[0].shape[1]
    found = np.empty((len(targets), rows))
    for row in range(rows):
        places = np.sort(np.concatenate([table[:, row] for table in each]))
        chance = sum(
            weight * np.interp(places, table[:, row], levels, left=0.0, right=1.0)
            for weight, table in zip(weights, each, strict=True)
        )
        found[:, row] = np.interp(targets, chance, places)
    return found
