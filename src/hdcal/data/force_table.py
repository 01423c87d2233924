"""Read a force over time: a table without a deformation, to drive a model with."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from hdcal.data.findings import FileFindings
from hdcal.data.used_columns import read_columns

_COLUMNS = ("time", "force")


def read_force(
    path: Path | str, columns: Mapping[str, str] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Read time [s] and force [N] from a CSV file, (n,) each.

    Args:
        path: the file; other columns than time and force are not looked at.
        columns: quantity -> header with its unit in brackets.

    Raises:
        InputError: holds everything that is wrong with the file.
    """
    with FileFindings(str(path)) as findings:
        found = read_columns(
            path, columns, findings, quantities=_COLUMNS, required=_COLUMNS, fewest=2
        )
        if "time" in found.values:
            back = np.zeros(len(found.table.rows), bool)
            back[1:] = np.diff(found.values["time"]) <= 0.0
            words = "the time is not later than that of the row before"
            remedy = "Write a jump of the force as two rows a little apart"
            found.find(back, "time", words, remedy)
    return found.values["time"], found.values["force"]
