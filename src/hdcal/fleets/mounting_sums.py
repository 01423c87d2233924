"""From readings to what each mounting says: seven sums, whatever the number of rows."""

import numpy as np

from hdcal.data.case import Case
from hdcal.evidence.prepare import moments
from hdcal.inference.gear_sums import MountingSums


def mounting_sums(case: Case) -> MountingSums:
    """Return the sums of a case, one entry for each gear in each mounting."""
    records, gear = case.records, case.gear
    labels = np.stack([np.asarray(records.specimen), np.asarray(records.run)])
    pairs, of_row = np.unique(labels, axis=1, return_inverse=True)
    warm = np.asarray(records.temperature) - gear.reference_temperature
    loss, _ = moments(gear.priors["alpha"])
    x = np.asarray(records.deformation) * (1.0 - loss * warm)
    y = np.asarray(records.force)
    rows = np.bincount(of_row).astype(float)
    mean_x, mean_y = (np.bincount(of_row, v) / rows for v in (x, y))
    about_x, about_y = x - mean_x[of_row], y - mean_y[of_row]
    products = (about_x**2, about_x * about_y, about_y**2)
    xx, xy, yy = (np.bincount(of_row, product) for product in products)
    return MountingSums(pairs[0], rows, mean_x, mean_y, xx, xy, yy)
