"""A hypothesis at its most probable point, by all rows or by some of them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdcal.evidence.case_evidence import CaseEvidence
from hdcal.evidence.closed_form import AmplitudeCells
from hdcal.evidence.design_matrix import DesignMatrix, fit_design, join_designs
from hdcal.evidence.inner_products import piece_products
from hdcal.evidence.piecewise_effect import PiecewiseEffect, amplitude_cells
from hdcal.evidence.prepare import PreparedCase
from hdcal.evidence.subspaces import SubspaceEvidence

_FLAT = 1e-12


def design_of(evidence: CaseEvidence, names: Sequence[str]) -> DesignMatrix:
    """Return what effects add at their most probable point; noise adds nothing."""
    single, parts = evidence.single, []
    for name in names:
        if name in single.names:
            index = single.names.index(name)
            found = single.parts[0].of(index)
            own = found.cells.piece - single.starts[index]
            cells = found.cells._replace(piece=own)
            best = int(np.argmax(np.logaddexp.reduce(found.log_evidence)))
            parts.append(_piece_design(evidence.piecewise[index], cells, best))
        elif name in evidence.subspaces.names:
            parts.append(_subspace_design(evidence.subspaces, name))
    return join_designs(parts, len(evidence.prepared.rows.reading))


def _piece_design(
    effect: PiecewiseEffect, cells: AmplitudeCells, cell: int
) -> DesignMatrix:
    """Return the piece on which a cell lies, with the cell's prior."""
    piece = cells.piece[cell]
    values = {
        f"{effect.name}.{name}": float(table[piece])
        for name, table in effect.values.items()
        if name not in effect.grid.amplitudes
    }
    precision = cells.precision[[cell]]
    # A flat prior has no precision.
    precision = np.where(precision == 0.0, _FLAT, precision)
    return DesignMatrix(
        effect.offsets[piece],
        effect.slopes[piece][None],
        np.asarray(cells.mean)[[cell]],
        1.0 / np.sqrt(precision),
        values,
    )


def _subspace_design(spaces: SubspaceEvidence, name: str) -> DesignMatrix:
    """Return a subspace at its most probable shape and scale."""
    shape, scale = spaces.likeliest(name)
    columns = spaces.columns[spaces.of(name)[shape]]
    columns = columns[np.any(columns != 0.0, axis=1)]
    count = len(columns)
    nothing = np.zeros(columns.shape[1])
    return DesignMatrix(nothing, columns, np.zeros(count), np.full(count, scale), {})


def stiffness_and_noise_beside(
    evidence: CaseEvidence, names: Sequence[str]
) -> tuple[float, float]:
    """Return the stiffness [N/mm] and noise sd [N] that are fitted beside effects."""
    prepared, rows = evidence.prepared, evidence.prepared.rows
    design = design_of(evidence, names)
    fit = fit_design(rows, design, prepared.noise_sd, 0.0)
    # The first coefficient is the deviation of log stiffness about least squares.
    shift = prepared.log_stiffness - np.log(prepared.base.stiffness)
    change = shift + prepared.log_stiffness_sd * fit.mean[0]
    left = (rows.reading - fit.predict()) * rows.weight
    freedom = max(len(left) - 3 - len(design.columns), 1)
    return (
        float(prepared.base.stiffness * (1.0 + change)),
        float(np.sqrt(np.sum(left**2) / freedom)),
    )


def fitted_curve(evidence: CaseEvidence, name: str) -> np.ndarray:
    """Return what one effect adds at its best fit [N], shape (n,)."""
    rows = evidence.prepared.rows
    design = design_of(evidence, [name])
    fit = fit_design(rows, design, evidence.prepared.noise_sd, 0.0)
    return fit.contribution(rows.base.shape[1])


def held_out_design(
    evidence: CaseEvidence, names: Sequence[str], kept: np.ndarray
) -> DesignMatrix:
    """Return the design of a hypothesis, its shapes chosen by the kept rows alone.

    Args:
        evidence: of the whole data.
        names: of its effects.
        kept: which rows may be seen, shape (n,).
    """
    parts = []
    for name in names:
        if name in evidence.single.names:
            effect = evidence.piecewise[evidence.single.names.index(name)]
            parts.append(_likeliest_piece(evidence.prepared, effect, kept))
        else:
            parts.append(design_of(evidence, [name]))
    return join_designs(parts, len(kept))


def _likeliest_piece(
    prepared: PreparedCase, effect: PiecewiseEffect, kept: np.ndarray
) -> DesignMatrix:
    """Return the piece and cell that fit the kept rows best, at the pilot noise."""
    rows = prepared.rows
    independent = replace(
        rows,
        reading=rows.reading[kept],
        base=rows.base[kept],
        before=np.full(np.count_nonzero(kept), -1),
        weight=rows.weight[kept],
        correlations=np.zeros(1),
    )
    products = piece_products(
        independent, effect.offsets[:, kept], effect.slopes[:, kept]
    )
    cells, variance = amplitude_cells(effect, exact=True), prepared.noise_sd**2
    ee, eu, uu = (
        np.asarray(part)[0, cells.piece] / variance
        for part in (products.ee, products.eu, products.uu)
    )
    pull = cells.precision
    size = (eu + pull * cells.mean) / (uu + pull + 1e-12)
    size = np.clip(size, cells.low, cells.high)
    height = size * eu - 0.5 * size**2 * uu - 0.5 * ee
    height -= 0.5 * pull * (size - cells.mean) ** 2
    best = int(np.argmax(height + cells.log_height + cells.log_weight))
    return _piece_design(effect, cells, best)
