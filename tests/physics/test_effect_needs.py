"""Every effect looks at the covariates that it needs, and at no others."""

import dataclasses

import numpy as np
import pytest
from effect_bench import BEYOND_RECORDS, bare, contribution, everyone, typical

from hdcal import EFFECTS

# Covariates that an effect may only look at if it needs one of these features.
# A memory of time or of unloading starts anew with the run or the specimen.
LICENCES = {
    "temperature": {"temperature"},
    "time": {"time", "holds or rates", "rates", "cycles"},
    "angle": {"angle"},
    "rate": {"rates", "time"},
    "sense": {"unloading", "cycles"},
    # A loop remembers the movements of its run, load cycles those of their specimen.
    "run": {"run", "runs", "time", "cycles", "unloading"},
    "specimen": {"specimen", "specimens", "cycles", "unloading"},
}
# Features, and the covariates of which at least one must then matter.
CARRIERS = {
    "temperature": {"temperature"},
    "time": {"time"},
    "angle": {"angle"},
    "rates": {"rate", "time"},
    "unloading": {"sense", "order"},
    "holds or rates": {"time"},
    "cycles": {"order", "time", "sense"},
    "run": {"run"},
    "runs": {"run"},
    "specimen": {"specimen"},
    "specimens": {"specimen"},
    "force_sd": {"force_sd"},
}


def changed(records, what):
    """Return the records with one covariate changed, all else equal."""
    rng = np.random.default_rng(8)
    rows = len(records.deformation)
    match what:
        case "time":
            # Still in order within each run, but at another, uneven pace.
            change = {"time": 1.7 * records.time + 0.01 * records.time**2}
        case "sense":
            change = {"sense": -records.sense, "direction": -records.direction}
        case "order":
            # The same deformations, reached the other way round.
            names = ("deformation", "direction", "sense", "rate")
            change = {n: getattr(records, n).copy() for n in names}
            for run in np.unique(records.run):
                rows = np.flatnonzero(records.run == run)
                for n, column in change.items():
                    flip = -1.0 if n != "deformation" else 1.0
                    column[rows] = flip * getattr(records, n)[rows[::-1]]
        case "run" | "specimen":
            change = {what: np.sort(rng.integers(0, 3, rows))}
        case _:
            change = {what: getattr(records, what) + rng.uniform(1.0, 2.0, rows)}
    return dataclasses.replace(records, **change)


def matters(name, what, records, base, reading) -> bool:
    """Return whether a covariate changes what the effect contributes."""
    before, after = (
        contribution([typical(name)], (), bare(base), seen, reading)
        for seen in (records, changed(records, what))
    )
    rows = len(records.deformation)
    if what == "force_sd":
        before, after = before[rows:], after[rows:]
    if what == "order":
        # The reversed loading has the same deformations in reversed rows.
        for run in np.unique(records.run):
            own = np.flatnonzero(records.run == run)
            after[own] = after[own[::-1]].copy()
    return bool(np.max(np.abs(after - before)) > 1e-9)


@everyone
@pytest.mark.parametrize("covariate", sorted(LICENCES))
def test_it_looks_at_nothing_undeclared(name, covariate, loading, base, reading):
    if matters(name, covariate, loading, base, reading):
        assert EFFECTS[name].needs & LICENCES[covariate]


@pytest.mark.parametrize(
    ("name", "need"),
    [
        (name, need)
        for name in sorted(EFFECTS)
        for need in sorted(EFFECTS[name].needs - BEYOND_RECORDS)
    ],
)
def test_it_uses_what_it_needs(name, need, loading, base, reading):
    used = [
        covariate
        for covariate in sorted(CARRIERS[need])
        if matters(name, covariate, loading, base, reading)
    ]
    assert used
