"""Deformations that no gear of its radius reaches."""

from collections.abc import Iterator

import numpy as np

from hdcal.data.case import Gear
from hdcal.data.measurements import Labels
from hdcal.data.used_columns import Columns

_REMEDY = "Check the unit of the column and the radius in the gear file"


def too_far(columns: Columns, specimen: Labels, gear: Gear) -> None:
    """Find the farthest row of each specimen that no gear of this radius reaches."""
    # Where something else is wrong, numbers may be missing or wild.
    if columns.findings or "deformation" not in columns.used:
        return
    rows = columns.table.rows
    found = beyond_radius(columns.values["deformation"], specimen.index, rows, gear)
    columns.findings.add_rows(found, columns.used["deformation"].header)


def beyond_radius(
    deformation: np.ndarray, specimen: np.ndarray, rows: np.ndarray, gear: Gear
) -> Iterator[tuple[int, str, str]]:
    """Yield row, problem and remedy of the farthest of each specimen's, if too far.

    Args:
        deformation: as read, shape (n,) [mm].
        specimen: index of each reading's, shape (n,).
        rows: what each reading's row is called, shape (n,).
        gear: whose radius it is.
    """
    size = np.abs(deformation)
    beyond = np.flatnonzero(size >= gear.reach)
    rising = beyond[np.argsort(size[beyond], kind="stable")]
    farthest = {int(specimen[place]): int(place) for place in rising}
    radius = f"on a radius of {gear.geometry.radius:g} mm"
    for place in sorted(farthest.values()):
        words = f"a deformation of {size[place]:g} mm {radius}"
        yield int(rows[place]), words, _REMEDY
