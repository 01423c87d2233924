"""Unknown structure: the kernels that these rows can show and no effect spans."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from hdcal.evidence.kernels import kernel_columns, visible_kernels
from hdcal.evidence.linear_rows import LinearRows, remove_base
from hdcal.evidence.local_structure import direction_families, likeliest_directions
from hdcal.evidence.piecewise_effect import PiecewiseEffect
from hdcal.evidence.prepare import PreparedCase
from hdcal.evidence.subspaces import WIDTH, SubspaceEffect, SubspaceEvidence

# Kernels that share the prior of the unknown; a loading that shows fewer leaves the
# rest of that prior unused, for what it cannot see.
_KERNELS = 15
# A kernel of which one library effect spans this much would be that effect again.
_SPANNED = 0.9


def unknown_kernels(
    case: PreparedCase,
    effects: Sequence[PiecewiseEffect],
    subspaces: Iterable[SubspaceEffect],
) -> tuple[dict[str, np.ndarray], dict[str, float]]:
    """Return the kernels of unknown structure.

    Args:
        case: whose rows show them.
        effects: of the library, in pieces.
        subspaces: of the library.

    Returns:
        Columns of each by name, shape (WIDTH, n), and log of the number of kernels
        that it was chosen from.
    """
    chosen = likeliest_directions(case, direction_families(case.records))
    tables = kernel_columns(case.records) | {name: table for name, table, _ in chosen}
    names, kernels = visible_kernels(case.rows, tables, WIDTH)
    spanned = _spanned(case.rows, kernels, effects, subspaces)
    kept = {
        n: k for n, k, gone in zip(names, kernels, spanned, strict=True) if not gone
    }
    log_counts = {name: log_count for name, _, log_count in chosen}
    return kept, {name: log_counts.get(name, 0.0) for name in kept}


def unknown_evidence(
    subspaces: SubspaceEvidence, log_counts: Mapping[str, float], none: np.ndarray
) -> np.ndarray:
    """Return the log evidence of unknown structure, [correlation].

    Args:
        subspaces: evidence of each kernel.
        log_counts: log of the number of kernels that each was chosen from.
        none: log evidence without any structure, for the shape.
    """
    # Where a loading shows no kernel at all, unknown structure has no evidence.
    kernels = [np.full_like(none, -np.inf)]
    kernels += [subspaces.by_correlation(n) - each for n, each in log_counts.items()]
    return np.logaddexp.reduce(kernels, axis=0) - np.log(max(len(log_counts), _KERNELS))


def _spanned(
    rows: LinearRows,
    kernels: np.ndarray,
    effects: Sequence[PiecewiseEffect],
    subspaces: Iterable[SubspaceEffect],
) -> np.ndarray:
    """Return which kernels are little more than one effect of the library."""
    flat = kernels.reshape(-1, kernels.shape[-1])
    whole = np.sum(kernels**2, axis=(1, 2))

    def captured(directions):
        inside = (flat @ directions.T) ** 2
        return inside.reshape(*kernels.shape[:2], -1).sum(axis=1)

    nothing = np.zeros((1, kernels.shape[-1]))
    left = remove_base(
        rows, np.concatenate([nothing, *(each.shapes for each in effects)])
    )
    size = np.linalg.norm(left, axis=1, keepdims=True)
    best = captured(left / np.where(size > 0.0, size, 1.0)).max(axis=1)
    for table in (table for each in subspaces for table in each.columns):
        _, strength, axes = np.linalg.svd(remove_base(rows, table), full_matrices=False)
        axes = axes[strength > 1e-8 * strength[0]]
        best = np.maximum(best, captured(axes).sum(axis=1))
    return best >= _SPANNED * whole
