"""Tables without a deformation: a force over time, to drive a model with."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.findings import FileFindings
from hdcal.data.measurements.checks import FEWEST_ROWS, check_rows, check_whole
from hdcal.data.tables.columns import REQUIRED, choose_columns
from hdcal.data.tables.headers import QUANTITIES
from hdcal.data.tables.sources import read_source
from hdcal.data.tables.values import read_values


def read_columns(
    data: Any,
    mapping: Mapping[str, str] | None,
    findings: FileFindings,
    *,
    quantities: Sequence[str] = QUANTITIES,
    required: tuple[str, ...] = REQUIRED,
    fewest: int = FEWEST_ROWS,
) -> pd.DataFrame:
    """Read the columns of a source that hold known quantities, right or wrong.

    Args:
        data: the file, or a table in memory.
        mapping: quantity -> header with its unit in brackets, or None.
        findings: gets one for everything that is wrong.
        quantities: to look for.
        required: which of them must be there.
        fewest: rows that are needed.

    Raises:
        InputError: there is no table.
    """
    table, _ = read_source(data, findings)
    used = choose_columns(table, mapping or {}, quantities, required, findings)
    values, _ = read_values(table, used, findings)
    frame = pd.DataFrame(values, index=table.rows)
    check_whole(frame, used, table, findings, fewest)
    check_rows(frame, used, findings)
    return frame


def read_force(
    path: Any, columns: Mapping[str, str] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Read time [s] and force [N] from a table without a deformation, (n,) each.

    Raises:
        InputError: holds everything that is wrong with the file.
    """
    both = ("time", "force")
    with FileFindings(str(path)) as findings:
        how: dict = {"quantities": both, "required": both, "fewest": 2}
        table = read_columns(path, columns, findings, **how)
        if "time" in table:
            words = "the time is not later than that of the row before"
            remedy = "Write a jump of the force as two rows a little apart"
            back = table.index[1:][np.diff(table["time"]) <= 0.0].tolist()
            findings.add_rows(((row, words, remedy) for row in back), "time")
    return table["time"].to_numpy(), table["force"].to_numpy()
