"""Tables without a deformation: a force over time, to drive a model with."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.findings import FileFindings
from hdcal.data.measurements.checks import check_rows, check_whole
from hdcal.data.tables.columns import choose_columns
from hdcal.data.tables.sources import read_source
from hdcal.data.tables.values import read_values

_NEEDED = ("time", "force")


def read_force(
    path: Any, columns: Mapping[str, str] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Read time [s] and force [N] from a table without a deformation, (n,) each.

    Raises:
        InputError: holds everything that is wrong with the file.
    """
    with FileFindings(str(path)) as findings:
        table, _ = read_source(path, findings)
        used = choose_columns(table, columns or {}, _NEEDED, _NEEDED, findings)
        values, _ = read_values(table, used, findings)
        frame = pd.DataFrame(values, index=table.rows)
        check_whole(frame, used, findings, fewest=2)
        check_rows(frame, used, findings)
        if "time" in frame:
            words = "the time is not later than that of the row before"
            remedy = "Write a jump of the force as two rows a little apart"
            back = frame.index[1:][np.diff(frame["time"]) <= 0.0].tolist()
            findings.add_rows(((row, words, remedy) for row in back), "time")
    return frame["time"].to_numpy(), frame["force"].to_numpy()
