"""Single readings that repeat a turning point: of loading or of unloading?"""

from dataclasses import replace

import numpy as np

from hdcal.data.case import Case
from hdcal.evidence.row_features import take_rows


def without_repeats(case: Case) -> tuple[Case, int]:
    """Return a case without such readings, and how many there were.

    Whether the movement had turned when it was taken decides on which side of a loop it
    lies, and no deformation tells. Taken for the wrong side a few of them hide what the
    others say. Two or more in a row are a hold, and where the time was read so may be
    one.
    """
    records = case.records
    if "time" in records.known:
        return case, 0
    order = np.argsort(np.asarray(records.run), kind="stable")
    move = np.diff(np.asarray(records.deformation)[order])
    same_run = np.diff(np.asarray(records.run)[order]) == 0
    # Moves before, to and after a reading that has two others on either side.
    before, to, after = (move[k : len(move) - 2 + k] for k in range(3))
    within = np.logical_and.reduce([same_run[k : len(move) - 2 + k] for k in range(3)])
    turns = within & (to == 0.0) & (before * after < 0.0)
    repeated = order[np.flatnonzero(turns) + 2]
    if len(repeated) == 0:
        return case, 0
    kept = np.delete(np.arange(len(records.run)), repeated)
    return replace(case, records=take_rows(records, kept)), len(repeated)
