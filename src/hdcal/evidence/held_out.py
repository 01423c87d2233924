"""The most probable point of a hypothesis when some rows are left out."""

from collections.abc import Sequence

import numpy as np

from hdcal.evidence.assessment import Assessment, design_of
from hdcal.evidence.design_matrix import Design, design_at, join_designs
from hdcal.evidence.effect_lines import Lines, entries_of
from hdcal.evidence.prepare import Setting


def design_without(found: Assessment, names: Sequence[str], kept: np.ndarray) -> Design:
    """Return the design of a hypothesis, its shapes chosen by the kept rows alone.

    Args:
        found: evidences of the whole data.
        names: of its effects.
        kept: which rows may be seen, shape (n,).
    """
    parts = []
    for name in names:
        if name in found.singles.names:
            lines = found.lines[found.singles.names.index(name)]
            parts.append(_likeliest(found.setting, lines, kept))
        else:
            parts.append(design_of(found, [name]))
    return join_designs(parts, len(kept))


def _likeliest(setting: Setting, lines: Lines, kept: np.ndarray) -> Design:
    """Return the line and cell that fit the kept rows best, at the pilot noise."""
    rows = setting.rows
    weight = np.asarray(rows.weight)[kept, None]
    base = np.asarray(rows.base)[kept] * weight
    gram = base.T @ base + np.diag(np.asarray(rows.precision))
    left, slope = (
        weight * np.asarray(table)[:, kept].T
        for table in (np.asarray(rows.reading) - lines.offsets, lines.slopes)
    )
    entries = entries_of(lines, tight=True)
    node, variance = entries["node"], setting.noise_sd**2
    inside = [np.linalg.solve(gram, base.T @ table) for table in (left, slope)]
    ee, eu, uu = (
        (np.sum(a * b, axis=0) - np.sum((base.T @ a) * fitted, axis=0))[node] / variance
        for a, b, fitted in (
            (left, left, inside[0]),
            (left, slope, inside[1]),
            (slope, slope, inside[1]),
        )
    )
    pull = entries["precision"]
    size = (eu + pull * entries["mean"]) / (uu + pull + 1e-12)
    size = np.clip(size, entries["low"], entries["high"])
    height = size * eu - 0.5 * size**2 * uu - 0.5 * ee
    height -= 0.5 * pull * (size - entries["mean"]) ** 2
    best = int(np.argmax(height + entries["log_height"] + entries["log_weight"]))
    return design_at(lines, int(node[best]), entries["mean"][best], pull[best])
