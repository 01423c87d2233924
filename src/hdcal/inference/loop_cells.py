"""A loop of any shape: cells that stick and then slip, within shares of the range."""

import numpy as np
from jaxtyping import Float

from hdcal.data.records import Records
from hdcal.exported import jit
from hdcal.inference.padding import pad_records
from hdcal.physics.history import stop_cells

_stop_cells = jit(stop_cells)


def loop_cells(records: Records, shares: np.ndarray) -> Float[np.ndarray, "c n"]:
    """Return the state of each cell, −1 … 1, row by row.

    Args:
        records: the rows.
        shares: of the range of the deformation, after which a cell slips, shape (c,).
    """
    padded = pad_records(records)
    reach = shares * np.ptp(np.asarray(records.deformation))
    states = _stop_cells(padded.deformation, padded.run, reach)
    return np.asarray(states)[:, : len(records.run)]
