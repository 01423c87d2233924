"""Where is the gap: one family-wise gate, its cells, and shares by covariate."""

from collections.abc import Sequence

import numpy as np

from hdcal.data.case import Case
from hdcal.diagnosis.regions import Declared, declare_cells
from hdcal.diagnosis.verdict import Cell, Share, Where
from hdcal.evidence.additive_gap import Additive
from hdcal.evidence.assessment import Assessment
from hdcal.evidence.local_scan import families
from hdcal.evidence.residual_test import Gate, gate
from hdcal.report.parameters import Interval

# Family-wise probability that pure noise is called a gap.
FALSE_ALARM = 0.05
LEVELS = (0.05, 0.5, 0.95)


def interval(draws) -> Interval:
    """Return the equal-tailed 90 % interval of draws."""
    low, middle, high = np.quantile(np.asarray(draws), LEVELS)
    return Interval(float(middle), float(low), float(high))


def look(
    found: Assessment, case: Case, correlation: float, rng: np.random.Generator
) -> tuple[list[Declared], Gate]:
    """Test the base model in every declared cell and along every effect.

    Args:
        found: what the library's effects look like on these rows.
        case: for the labels.
        correlation: AR(1) coefficient of the noise.
        rng: source of randomness.
    """
    cells, inside, curves, labels, local = directions_of(found, case)
    tested = gate(found.setting, correlation, inside, curves, labels, local, rng)
    return cells, tested


def directions_of(
    found: Assessment, case: Case
) -> tuple[list[Declared], np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the cells, and all directions in which a gap is looked for, by column.

    Args:
        found: what the library's effects look like on these rows.
        case: for the labels.

    Returns:
        Cells, and as `gate` takes them: cells, curves, labels and local directions.
    """
    setting = found.setting
    cells = declare_cells(setting.records, case.run_labels, case.specimen_labels)
    # Of five rows none makes a cell.
    empty = np.zeros((len(setting.records.force), 0))
    members = np.column_stack([empty, *(cell.rows for cell in cells)])
    curves = [_two(lines.shapes) for lines in found.lines]
    curves += [
        _two(found.subspaces.columns[index][:4])
        for name in found.wide
        for index in found.subspaces.of(name)[:1]
    ]
    declared = np.concatenate(curves).T if curves else np.zeros((len(members), 0))
    # Many small offsets of runs or gears show in no single one of them.
    labels = [setting.records.run, setting.records.specimen]
    several = [label for label in labels if len(np.unique(label)) > 1]
    labels = np.column_stack([empty, *several])
    local = [empty, *(family.columns.T for family in families(setting.records))]
    return cells, members, declared, labels, np.column_stack(local)


def _two(table: np.ndarray) -> np.ndarray:
    """Return two curves that stand for many."""
    return table[[len(table) // 3, (2 * len(table)) // 3]]


def describe(
    found: Assessment,
    case: Case,
    cells: Sequence[Declared],
    tested: Gate,
    smooth: Additive | None,
    detected: bool,
) -> Where:
    """Put the outcome of the gate into values for people.

    Args:
        found: for the order of the rows.
        case: whose rows were looked at.
        cells: that were declared.
        tested: outcome of the gate.
        smooth: the smooth gap, None when none is detected.
        detected: whether the gate is passed.
    """
    order = found.setting.order
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
                float(tested.bias[index]),
                float(tested.half_width[index]),
                float(tested.z[index]),
                float(np.sum(left**2 * cell.rows) / total) if detected else 0.0,
            )
            for index, cell in enumerate(cells)
        ),
        shares=_shares(smooth) if detected and smooth is not None else (),
        residual_N=residual,
        gap_N=gap,
        records=case.records,
    )


def _shares(smooth: Additive) -> tuple[Share, ...]:
    found = [Share(name, interval(draws)) for name, draws in smooth.shares.items()]
    return tuple(sorted(found, key=lambda share: -share.share.median))
