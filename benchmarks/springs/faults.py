"""Faults of real records, each drawn at a random size.

A fault of the part changes the true curve; a fault of the rig changes what is read.
"""

from collections.abc import Callable

import numpy as np
from scipy.signal import lfilter

from benchmarks.springs.spring import Spring, moved_up

Fault = Callable[[Spring, np.random.Generator], float]


def _after(spring: Spring, low: float, high: float, rng: np.random.Generator) -> int:
    return max(3, int(rng.uniform(low, high) * spring.rows))


def yields(spring: Spring, rng: np.random.Generator) -> float:
    """Yield at a share of the stroke; unloading is elastic."""
    limit = rng.uniform(0.4, 0.85)
    hardening = rng.uniform(0.02, 0.15)
    plastic, left = 0.0, np.zeros(spring.rows)
    for row, x in enumerate(spring.deformation):
        beyond = x - plastic - (limit * spring.stroke + hardening * plastic)
        plastic += max(beyond, 0.0) / (1.0 + hardening)
        left[row] = plastic
    spring.straight &= left == 0.0
    spring.force = spring.force - spring.stiffness * left
    return limit


def breaks(spring: Spring, rng: np.random.Generator) -> float:
    """Break during the first loading; the grips go on moving apart."""
    top = int(np.argmax(spring.deformation))
    spring.keep(np.arange(spring.rows) <= max(top, 14))
    row = _after(spring, 0.55, 0.93, rng)
    left = rng.uniform(0.0, 0.6) * spring.force[row - 1]
    fall = np.linspace(1.0, rng.uniform(0.0, 1.0), spring.rows - row)
    spring.force[row:] = left * fall
    spring.straight[row:] = False
    spring.segments["after the break"] = [row, spring.rows]
    return row / spring.rows


def preload(spring: Spring, rng: np.random.Generator) -> float:
    """Initial tension: much stiffer until a force is reached."""
    share, ratio = rng.uniform(0.1, 0.6), rng.uniform(10.0, 40.0)
    knee = share * spring.stroke / ratio
    stiff = ratio * spring.stiffness * spring.deformation
    beyond = share * spring.largest + spring.stiffness * (spring.deformation - knee)
    spring.force = np.where(spring.deformation < knee, stiff, beyond)
    spring.straight &= spring.deformation > knee
    return share


def toe(spring: Spring, rng: np.random.Generator) -> float:
    """A softer start, its slope growing to that of the spring."""
    share, start = rng.uniform(0.05, 0.3), rng.uniform(0.05, 0.5)
    end, x = share * spring.stroke, spring.deformation
    lost = (1.0 - start) * (np.minimum(x, end) - np.minimum(x, end) ** 2 / (2 * end))
    spring.force = spring.force - spring.stiffness * lost
    spring.straight &= x > end
    return share


def approach(spring: Spring, rng: np.random.Generator) -> float:
    """A part of the stroke without contact."""
    share = rng.uniform(0.05, 0.4)
    free = share * spring.stroke
    spring.force = spring.stiffness * np.maximum(spring.deformation - free, 0.0)
    spring.straight &= spring.deformation > free
    return share


def friction(spring: Spring, rng: np.random.Generator) -> float:
    """Coulomb friction that builds up over some per cent of the stroke."""
    share = rng.uniform(0.01, 0.12)
    length = rng.uniform(0.005, 0.03) * spring.stroke
    pull, sense = np.zeros(spring.rows), moved_up(spring)
    steps = np.abs(np.diff(spring.deformation, prepend=spring.deformation[0]))
    for row in range(1, spring.rows):
        decay = np.exp(-steps[row] / length)
        pull[row] = sense[row] + (pull[row - 1] - sense[row]) * decay
    spring.force = spring.force + share * spring.largest * pull
    return share


def jump_of_force(spring: Spring, rng: np.random.Generator) -> float:
    """The zero of the force channel changes between two rows."""
    row = _after(spring, 0.15, 0.85, rng)
    size = rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(-1.3, 0.3)
    spring.force[row:] += size * spring.largest
    spring.segments["after the jump of the force"] = [row, spring.rows]
    return size


def jump_of_deformation(spring: Spring, rng: np.random.Generator) -> float:
    """The gauge is zeroed, or slips, between two rows."""
    row = _after(spring, 0.15, 0.85, rng)
    size = rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(-1.3, 1.0)
    spring.deformation[row:] += size * spring.stroke
    spring.segments["after the jump of the deformation"] = [row, spring.rows]
    return size


def tare(spring: Spring, rng: np.random.Generator) -> float:
    """Some first rows were taken at rest, before the force was set to zero."""
    first = min(int(rng.integers(2, 12)), spring.rows // 4)
    size = rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(-1.0, 0.5)
    spring.force = np.concatenate(
        [np.full(first, size * spring.largest) + spring.force[0], spring.force]
    )
    start = np.full(first, spring.deformation[0])
    spring.deformation = np.concatenate([start, spring.deformation])
    spring.straight = np.concatenate([np.zeros(first, bool), spring.straight])
    step = spring.time[1] - spring.time[0]
    spring.time = np.arange(spring.rows) * step
    spring.segments["before the tare"] = [0, first]
    return size


def opposite_sign(spring: Spring, rng: np.random.Generator) -> float:
    """The controller reports the force with the other sign."""
    spring.force = -spring.force
    return 1.0


def spikes(spring: Spring, rng: np.random.Generator) -> float:
    """A few wild readings of the force, alone or two in a row."""
    count = int(rng.integers(1, max(2, min(6, spring.rows // 12))))
    size = 10 ** rng.uniform(-0.7, 1.0)
    rows = rng.choice(np.arange(1, spring.rows - 1), count, replace=False)
    if rng.random() < 0.3:
        rows = np.unique([*rows, rows[0] + 1])
    spring.force[rows] += size * spring.largest * rng.choice([-1.0, 1.0], len(rows))
    spring.straight[rows] = False
    return size


def jitter(spring: Spring, rng: np.random.Generator) -> float:
    """A gauge of the deformation that trembles."""
    share = 10 ** rng.uniform(-2.3, -0.8)
    scatter = rng.normal(0.0, share * spring.stroke, spring.rows)
    spring.deformation = spring.deformation + scatter
    return share


def oversampled(spring: Spring, rng: np.random.Generator) -> float:
    """The logger is faster than the converter: each reading comes several times."""
    times = int(rng.integers(3, 15))
    if spring.rows < 12 * times:
        times = max(2, spring.rows // 12)
    spring.keep(np.arange(spring.rows) // times * times)
    return float(times)


def correlated(spring: Spring, rng: np.random.Generator) -> float:
    """Noise of the force that is remembered over many rows."""
    memory = rng.uniform(0.8, 0.99)
    scale = spring.noise * np.sqrt(1.0 - memory**2)
    new = rng.normal(0.0, scale, spring.rows)
    spring.force = spring.force + lfilter([1.0], [1.0, -memory], new)
    spring.noise *= 0.2
    return memory


# Of these a spring has one at most: each sets the start of the curve.
STARTS: tuple[Fault, ...] = (preload, toe, approach)
# In the order in which they act.
OF_PART: tuple[Fault, ...] = (*STARTS, yields, friction, breaks)
OF_RIG: tuple[Fault, ...] = (
    jump_of_force,
    jump_of_deformation,
    tare,
    opposite_sign,
    spikes,
    jitter,
    correlated,
    oversampled,
)
