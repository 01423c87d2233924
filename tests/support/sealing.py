"""Small blind checks for tests, and diagnosers that other processes can import."""

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hdcal.blind.label import CaseAnswer, Label
from hdcal.blind.sealed_set import write_set

GEAR = """[gear]
name = "Ring"
radius_mm = 40.0
wall_thickness_mm = 0.8
length_mm = 40.0
material = "steel"
theory = "ring"
"""


def label(case: str, *, withheld: tuple[str, ...] = (), **changed) -> Label:
    """Return a label whose curves are NumPy's numbers, as a maker's are."""
    known = {"kind": "null", "truth": (), "program": "ramp", "rows": np.int64(20)}
    given = {"r": np.float64(0.1), "noise": "iid", "correlation": 0.0, "sigma": 0.3}
    clean = tuple(np.linspace(0.1, 0.3, 20))
    return Label(
        case, **{**known, **given, "clean": clean, "withheld": withheld, **changed}
    )


def table(case: str) -> str:
    """Return a ramp with noise that only this case has."""
    rng = np.random.default_rng(list(case.encode()))
    deformation = np.linspace(0.02, 0.5, 20)
    force = 100.0 * deformation + rng.normal(0.0, 0.3, 20)
    rows = (f"{d:.4f},{f:.3f}" for d, f in zip(deformation, force, strict=True))
    return "deformation_mm,force_N\n" + "\n".join(rows) + "\n"


def drawn(count: int) -> Iterator[tuple[str, Label]]:
    """Draw cases; the second is to be answered without hysteresis."""
    for index in range(1, count + 1):
        name, withheld = f"c{index:02d}", ("hysteresis",) if index == 2 else ()
        yield table(name), label(name, withheld=withheld)


def sealed_set(folder: Path, count: int = 3, seed: int = 7) -> Path:
    """Write a set with its key beside it, and return its folder."""
    write_set(folder, drawn(count), GEAR, key_of(folder), mix="trial", seed=seed)
    return folder


def key_of(folder: Path) -> Path:
    """Return where the key of a set lies."""
    return folder.with_name(folder.name + ".key")


def by_library(case, library) -> CaseAnswer:
    """Answer by what was in the library and in the data, so that both are seen."""
    first = float(case.records.force[0])
    chances = dict.fromkeys(library, 0.0) | {"none": 1.0, "unknown": 0.0}
    given = {"detected": False, "p_value": 0.5, "noise_sd": abs(first)}
    return CaseAnswer(case.name, "none", None, None, ("none",), chances, {}, **given)


def slowly(case, library) -> CaseAnswer:
    """Answer after a while, so that there is time to be killed."""
    time.sleep(0.3)
    return by_library(case, library)


def deadly(case, library) -> CaseAnswer:
    """Kill whoever answers."""
    os.kill(os.getpid(), signal.SIGKILL)
    raise AssertionError


def wrong(case, library) -> CaseAnswer:
    """Break on one case."""
    if case.name == "c02":
        raise ZeroDivisionError("by nothing")
    return by_library(case, library)
