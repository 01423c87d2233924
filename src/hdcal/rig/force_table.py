"""Read a force over time: a table without a deformation, to drive a model with."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from hdcal.errors import Finding, InputError
from hdcal.rig.cells import read_cells
from hdcal.rig.columns import match_columns
from hdcal.rig.layout import LISTED, and_more, lay_out
from hdcal.rig.source_bytes import read_text
from hdcal.rig.table_checks import check_values
from hdcal.rig.units import column_to_code

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
