"""Read a force over time: a table without a deformation, to drive a model with."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from hdcal.data.cells import read_cells
from hdcal.data.columns import match_columns
from hdcal.data.layout import LISTED, and_more, lay_out
from hdcal.data.source_bytes import read_text
from hdcal.data.table_checks import check_values
from hdcal.data.units import column_to_code
from hdcal.errors import Finding, InputError

_COLUMNS = ("time", "force")
_FEWEST = 2


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
    file = str(path)
    text = read_text(Path(path), file)
    layout, findings = lay_out(text.utf8, file)
    used, wrong = match_columns(
        layout.headers,
        columns or {},
        file,
        layout.header_row,
        quantities=_COLUMNS,
        required=_COLUMNS,
    )
    findings += wrong
    values, wrong = read_cells(layout, used, file)
    findings += wrong
    for quantity, column in used.items():
        with np.errstate(over="ignore"):
            values[quantity] = column_to_code(values[quantity], quantity, column.unit)
    findings += check_values(values, used, layout, file, fewest=_FEWEST)
    if "time" in values:
        back = np.flatnonzero(np.diff(values["time"]) <= 0.0) + 1
        words = "the time is not later than that of the row before"
        remedy = "Write a jump of the force as two rows a little apart"
        header = used["time"].header
        findings += [
            Finding(file, words, remedy, int(layout.rows[index]), header)
            for index in back[:LISTED]
        ]
        findings += and_more(len(back), "rows like these", file, header)
    if findings:
        raise InputError(findings)
    return values["time"], values["force"]
