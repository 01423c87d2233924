"""Records of simulated gears as a table, and the checks of what is read from them."""

from dataclasses import fields

import numpy as np
import pandas as pd
import pytest

from hdcal.errors import InputError
from hdcal.fleets.reading.readings import FleetReadings

SIZES = {"wall_thickness_mm": 0.68, "radius_mm": 40.0, "length_mm": 70.0}


def records(gears=8, runs=2, rows=24, seed=3, loop=0.0) -> pd.DataFrame:
    """Return readings of gears G0, G1, …: up, and with a loop up and down."""
    rng = np.random.default_rng(seed)
    x = np.linspace(0.02, 0.5, rows)
    sense = np.ones(rows)
    if loop:
        x = np.concatenate([x[::2], x[::-2]])
        sense = np.repeat([1.0, -1.0], rows // 2)
    parts = [
        pd.DataFrame(
            {
                "gear": f"G{gear}",
                "run": run,
                "deformation_mm": x,
                "force_N": 200.0 * (1.0 + 0.01 * rng.standard_normal()) * x
                + rng.normal(0.0, 0.5)
                + 0.5 * loop * sense
                + rng.normal(0.0, 0.2, rows),
            }
        )
        for gear in range(gears)
        for run in range(runs)
    ]
    return pd.concat(parts, ignore_index=True).round(6)


def same(one: FleetReadings, other: FleetReadings) -> None:
    """Check that readings are those of the same gears and mountings."""
    case, whole = one.case, other.case
    assert case.specimen_labels == whole.specimen_labels
    for name in ("lots", "operators", "rigs", "dates", "run_labels"):
        assert getattr(case, name) == getattr(whole, name), name
    for each in fields(one.sums):
        mine, theirs = (getattr(found.sums, each.name) for found in (one, other))
        assert mine == pytest.approx(theirs, rel=1e-9, abs=1e-9), each.name


def refused(make, *args, **kwargs) -> list[str]:
    """Return what an `InputError` says, finding by finding."""
    with pytest.raises(InputError) as caught:
        make(*args, **kwargs)
    return [str(finding) for finding in caught.value.findings]
