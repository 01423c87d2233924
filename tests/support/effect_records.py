"""Fixtures: loadings on which every effect can be seen, and a slow derivative."""

from collections.abc import Callable

import numpy as np
import pytest
from rigs import make_records

from hdcal.data.records import Geometry, Records
from hdcal.physics.chain import Base, Reading

EVERYTHING = (
    *("temperature", "time", "angle", "force_sd", "run", "specimen", "runs"),
    *("specimens", "unloading", "holds", "holds or rates", "rates", "cycles"),
)


@pytest.fixture(scope="session")
def gear() -> Geometry:
    """The article's gear, loaded below the rim."""
    return Geometry(0.68, 40.0, 70.0, 62.0, 0.3)


@pytest.fixture(scope="session")
def base() -> Base:
    """An ordinary gear on an ordinary rig."""
    return Base(209.0, 3.1e-4, 0.004, 1.5, 0.5)


@pytest.fixture(scope="session")
def reading() -> Reading:
    """A rig that reads the radial displacement."""
    return Reading(1.0, 20.0)


@pytest.fixture(scope="session")
def loading() -> Records:
    """Three gears at three temperatures: up, hold, down fast; up and down slowly."""
    top, counts = 0.54, [20, 5, 15, 10, 10]
    ends = [(0.0, top), (top, top), (top, 0.0), (0.0, top), (top, 0.0)]
    parts = [
        np.linspace(*end, count + 1)[1:]
        for end, count in zip(ends, [19, *counts[1:]], strict=True)
    ]
    deformation = np.concatenate([[0.0], *parts])
    step = np.repeat([1.0, 20.0, 1.0, 8.0, 8.0], counts)
    direction = np.repeat([1.0, 0.0, -1.0, 1.0, -1.0], counts)
    rate = np.diff(deformation, prepend=-top / 19) / step
    gear = np.repeat([0, 1, 2], len(deformation))
    return make_records(
        np.tile(deformation, 3),
        known=EVERYTHING,
        temperature=np.array([20.0, 80.0, 50.0])[gear],
        time=np.tile(np.cumsum(step), 3),
        angle=np.linspace(0.0, 6.0 * np.pi, len(gear)),
        direction=np.tile(direction, 3),
        sense=np.tile(np.where(direction == 0.0, 1.0, direction), 3),
        rate=np.tile(rate, 3),
        run=gear,
        specimen=gear,
    )


@pytest.fixture(scope="session")
def scattered() -> Callable[[int], Records]:
    """Return a maker of records without any order or sense, three runs of eight."""

    def make(seed: int) -> Records:
        rng, rows = np.random.default_rng(seed), 24
        run, sense = np.repeat([0, 1, 2], 8), rng.choice([-1.0, 1.0], rows)
        return make_records(
            rng.uniform(-0.5, 0.5, rows),
            known=EVERYTHING,
            temperature=rng.uniform(-20.0, 90.0, rows),
            time=np.tile(np.cumsum(rng.uniform(1.0, 60.0, 8)), 3),
            angle=rng.uniform(0.0, 2.0 * np.pi, rows),
            direction=sense * rng.choice([0.0, 1.0], rows),
            sense=sense,
            rate=rng.normal(0.0, 0.02, rows),
            run=run,
            specimen=run,
            force=rng.normal(0.0, 60.0, rows),
            force_sd=rng.uniform(0.0, 0.5, rows),
        )

    return make
