"""Labels that say more of a gear or a mounting: its lot, operator, rig, date."""

from collections.abc import Mapping

import numpy as np

from hdcal.data.dates import dates_of
from hdcal.data.measurements import Labels
from hdcal.data.tables.cells import NOT_STATED
from hdcal.errors import quoted


def further_labels(
    values: Mapping[str, np.ndarray], specimen: Labels, run: Labels
) -> tuple[dict[str, tuple[str, ...]], list[str]]:
    """Return lots of specimens, operators, rigs and dates of runs, as `Case` has them.

    Args:
        values: by quantity, of each row; those that are not there are not told.
        specimen: of each row.
        run: of each row.

    Returns:
        The labels, and notes on those that are not used.
    """
    lots, of_lots = _one_each(values.get("lot"), specimen, "lot")
    operators, of_operators = _one_each(values.get("operator"), run, "operator")
    rigs, of_rigs = _one_each(values.get("rig"), run, "rig")
    dates, of_dates = dates_of(values.get("date", ()), run.index)
    told = {"lots": lots, "operators": operators, "rigs": rigs, "dates": dates}
    notes = of_lots, of_operators, of_rigs, of_dates
    return told, [note for note in notes if note]


def _one_each(labels, of: Labels, quantity: str) -> tuple[tuple[str, ...], str]:
    """Return the lot of each specimen, or who or what read each run, and a note.

    Nothing is returned where the file does not tell them or one has several, which the
    note says.

    Args:
        labels: of each row; None where the file has none.
        of: the specimen, or the run, of each row.
        quantity: lot, operator or rig.
    """
    if labels is None:
        return (), ""
    pairs = dict.fromkeys(zip(of.index.tolist(), labels, strict=True))
    told: dict[int, list[str]] = {}
    for one, label in pairs:
        told.setdefault(one, []).append(label)
    for one, several in told.items():
        # A cell that was left empty is filled by the others of its gear or mounting.
        stated = [label for label in several if label != NOT_STATED] or several
        if len(stated) > 1:
            word = "specimen" if quantity == "lot" else "run"
            name = quoted(of.names[one])
            return (), f"{quantity}s are not used: {word} {name} has several"
        told[one] = stated
    return tuple(told[place][0] for place in range(len(of.names))), ""
