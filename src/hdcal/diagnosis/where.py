"""Where the gap is: one residual test, its cells, and shares by covariate."""

from collections.abc import Sequence

import numpy as np

from hdcal.data.case import Case
from hdcal.diagnosis.declared_cells import DeclaredCell, declare_cells
from hdcal.diagnosis.gap import Cell, CovariateShare, Where
from hdcal.evidence.case_evidence import CaseEvidence
from hdcal.evidence.local_structure import direction_families
from hdcal.evidence.residual_test import Directions, ResidualTest
from hdcal.evidence.smooth_gap import SmoothGap
from hdcal.report.intervals import Interval, credible_interval

# Family-wise probability that pure noise is called a gap.
FALSE_ALARM = 0.05


def about(middle: float, half_width: float) -> Interval:
    """Return the interval of a given half-width about its middle."""
    return Interval(middle, middle - half_width, middle + half_width)


def declared_directions(
    evidence: CaseEvidence, case: Case
) -> tuple[list[DeclaredCell], Directions]:
    """Return the cells, and all directions in which a gap is looked for.

    Args:
        evidence: what the library's effects look like on these rows.
        case: for the labels.
    """
    records = evidence.prepared.records
    cells = declare_cells(records, case.run_labels, case.specimen_labels, case.units)
    # Of five rows none makes a cell.
    empty = np.zeros((len(records.force), 0))
    curves = [_two(effect.shapes) for effect in evidence.piecewise]
    curves += [
        _two(evidence.subspaces.columns[index][:4])
        for name in evidence.subspace_effects
        for index in evidence.subspaces.of(name)[:1]
    ]
    # Many small offsets of runs or gears show in no single one of them.
    labels = [records.run, records.specimen]
    several = [label for label in labels if len(np.unique(label)) > 1]
    local = [family.columns.T for family in direction_families(records)]
    return cells, Directions(
        cells=np.column_stack([empty, *(cell.rows for cell in cells)]),
        curves=np.concatenate([empty.T, *curves]).T,
        labels=np.column_stack([empty, *several]).astype(int),
        local=np.column_stack([empty, *local]),
    )


def _two(table: np.ndarray) -> np.ndarray:
    """Return two curves that represent many."""
    return table[[len(table) // 3, (2 * len(table)) // 3]]


def describe_where(
    evidence: CaseEvidence,
    case: Case,
    cells: Sequence[DeclaredCell],
    tested: ResidualTest,
    smooth: SmoothGap | None,
) -> Where:
    """Put the outcome of the residual test into values for people.

    Without a detected gap there is no `smooth` part of it.
    """
    order = evidence.prepared.order
    residual, gap = np.empty(len(order)), np.zeros(len(order))
    residual[order] = tested.residual
    if smooth is not None:
        gap[order] = smooth.mean
    left = gap[order]
    total = max(float(np.sum(left**2)), 1e-300)
    return Where(
        p_value=tested.p_value,
        statistics=tested.statistics,
        cells=tuple(
            Cell(
                cell.covariate,
                cell.label,
                cell.start,
                cell.stop,
                cell.unit,
                int(cell.rows.sum()),
                about(float(tested.bias[index]), float(tested.half_width[index])),
                float(tested.z[index]),
                float(np.sum(left**2 * cell.rows) / total),
            )
            for index, cell in enumerate(cells)
        ),
        shares=_shares(smooth) if smooth is not None else (),
        residual_N=residual,
        gap_N=gap,
        records=case.records,
    )


def _shares(smooth: SmoothGap) -> tuple[CovariateShare, ...]:
    found = [
        CovariateShare(n, credible_interval(draws))
        for n, draws in smooth.shares.items()
    ]
    return tuple(sorted(found, key=lambda share: -share.share.median))
