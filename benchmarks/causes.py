"""What `causes` tells of simulated fleets whose gears have an effect, or have none.

Counted are gears, by what they have in truth and by what is told of them, and fleets of
which the share of gears without an effect lies in its 95 % interval; where that is none
or all, no interval with two ends can hold it, and nothing is counted.
"""

from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context

import numpy as np
import pandas as pd

import hdcal
from benchmarks.children import table

GEARS, PROCESSES, MOST_TOLD = 12, 2, 6
STIFFNESS, SCATTER, ZERO_SD, NOISE, STEP = 200.0, 0.01, 2.0, 0.3, 1e-4
FULL = np.linspace(0.02, 0.48, 14)
# Loaded and unloaded: deformation, and the way that it goes.
LOOP = np.r_[FULL, FULL[-2::-1]], np.repeat([1.0, -1.0], [14, 13])
SHORT = np.array([0.05, 0.25, 0.45]), np.ones(3)

Law = Callable[[float, np.ndarray, np.ndarray], np.ndarray]
Noise = Callable[[np.random.Generator, int], np.ndarray]


def straight(stiffness: float, x: np.ndarray, way: np.ndarray) -> np.ndarray:
    return stiffness * x


def friction(stiffness, x, way, *, loop_N: float):
    return stiffness * x + loop_N * way


def slack(stiffness, x, way, *, play_mm: float):
    return stiffness * np.maximum(x - play_mm, 0.0)


def stiffening(stiffness, x, way, *, share: float):
    return stiffness * x * (1.0 + share * (x / FULL[-1]) ** 2)


def bump(stiffness, x, way, *, high_N: float):
    return stiffness * x + high_N * np.exp(-0.5 * ((x - 0.25) / 0.05) ** 2)


def normal(rng: np.random.Generator, rows: int) -> np.ndarray:
    return rng.standard_normal(rows)


def correlated(rng: np.random.Generator, rows: int) -> np.ndarray:
    """Return noise of which neighbours have a correlation of 0.7."""
    noise = rng.standard_normal(rows)
    for row in range(1, rows):
        noise[row] = 0.7 * noise[row - 1] + np.sqrt(1.0 - 0.7**2) * noise[row]
    return noise


def heavy(rng: np.random.Generator, rows: int) -> np.ndarray:
    """Return Student's noise of three degrees of freedom, with an sd of 1."""
    return rng.standard_t(3.0, rows) / np.sqrt(3.0)


@dataclass(frozen=True)
class Kind:
    """Fleets of a kind: what acts in which share of their gears, and in what noise."""

    words: str
    fleets: int
    law: Law = straight
    share: float = 0.0
    noise: Noise = normal
    noise_sd: float = NOISE
    mountings: int = 2
    path: tuple[np.ndarray, np.ndarray] = LOOP


KINDS = (
    Kind("nothing", 20),
    Kind("nothing, ten mountings of three readings", 4, mountings=10, path=SHORT),
    Kind("friction, 0.8 N, in half", 20, partial(friction, loop_N=0.8), 0.5),
    Kind(
        "friction, 0.15 N, in half, half the noise",
        12,
        partial(friction, loop_N=0.15),
        0.5,
        noise_sd=0.5 * NOISE,
    ),
    Kind("friction, 0.08 N, in half", 8, partial(friction, loop_N=0.08), 0.5),
    Kind("slack, 0.05 mm, in three of ten", 12, partial(slack, play_mm=0.05), 0.3),
    Kind("stiffening by 6 %", 8, partial(stiffening, share=0.06), 1.0),
    Kind("stiffening by 1 %", 8, partial(stiffening, share=0.01), 1.0),
    Kind("nothing, correlation 0.7", 8, noise=correlated),
    Kind("nothing, heavy tails", 8, noise=heavy),
    Kind("a bump of 1 N, in no library", 12, partial(bump, high_N=1.0), 1.0),
    Kind("a bump of 0.2 N, in no library", 8, partial(bump, high_N=0.2), 1.0),
)


def simulated(place: int, seed: int) -> tuple[pd.DataFrame, np.ndarray]:
    """Return the readings of a fleet, and which of its gears have what acts."""
    kind, rng = KINDS[place], np.random.default_rng([place, seed])
    affected = rng.random(GEARS) < kind.share
    x, way = kind.path
    parts = []
    for gear, has_it in enumerate(affected):
        stiffness = STIFFNESS * (1.0 + SCATTER * rng.standard_normal())
        force = (kind.law if has_it else straight)(stiffness, x, way)
        for mounting in range(kind.mountings):
            error = ZERO_SD * rng.standard_normal()
            read = force + error + kind.noise_sd * kind.noise(rng, len(x))
            told = {"specimen": f"G{gear:02}", "run": mounting, "deformation_mm": x}
            parts.append(pd.DataFrame(told | {"force_N": STEP * np.round(read / STEP)}))
    return pd.concat(parts, ignore_index=True), affected


def told(place: int, seed: int) -> tuple[Counter[tuple[bool, str]], bool]:
    """Return how many gears were told what, and whether the share is in its interval.

    Causes of a gear stand in the order of the alphabet, so that they can be counted.
    """
    readings, affected = simulated(place, seed)
    found = hdcal.causes(readings, seed=seed)
    words = (" / ".join(sorted(each.kind)) or "not clear" for each in found.each_gear)
    share = next(each.share for each in found.causes if each.cause == "none")
    inside = bool(share.lo <= 1.0 - KINDS[place].share <= share.hi)
    return Counter(zip(affected.tolist(), words, strict=True)), inside


def lines(place: int, first: int, pool: ProcessPoolExecutor) -> Iterator[tuple]:
    """Yield what is told of gears with what acts, and of those without."""
    kind = KINDS[place]
    seeds = range(first, first + kind.fleets)
    answers = list(pool.map(told, [place] * kind.fleets, seeds))
    counted = sum((gears for gears, _ in answers), Counter())
    inside = f"{sum(good for _, good in answers)} of {kind.fleets}"
    if kind.share in (0.0, 1.0):
        inside = ""
    for has_it, state in ((True, "with it"), (False, "without")):
        found = Counter({w: n for (own, w), n in counted.items() if own == has_it})
        if not found:
            continue
        words = [f"{name} {count}" for name, count in found.most_common(MOST_TOLD)]
        if rest := found.total() - sum(n for _, n in found.most_common(MOST_TOLD)):
            words.append(f"others {rest}")
        yield kind.words, state, found.total(), "; ".join(words), inside


def main(repeats: int) -> None:
    """Print the table; seeds of its fleets begin at `repeats`."""
    spawned = get_context("spawn")
    heading = ("what acts", "gears", "number", "told", "share in its interval")
    with ProcessPoolExecutor(PROCESSES, mp_context=spawned) as pool:
        table(
            heading,
            (row for place in range(len(KINDS)) for row in lines(place, repeats, pool)),
        )
