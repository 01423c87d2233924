"""Records without a fault, of many kinds of part and test, with five kinds of noise."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.signal import lfilter


@dataclass(frozen=True)
class Record:
    """A record in a strange order of magnitude, with its origins elsewhere."""

    deformation: np.ndarray
    force: np.ndarray
    time: np.ndarray
    run: np.ndarray


Curve = tuple[np.ndarray, np.ndarray]


def _rows(rng: np.random.Generator, low: int = 15, high: int = 3000) -> int:
    return round(10 ** rng.uniform(np.log10(low), np.log10(high)))


def ramp(rng: np.random.Generator) -> Curve:
    """Loading only, straight or stiffening."""
    x = np.linspace(0.0, 1.0, _rows(rng))
    return x, x + rng.uniform(0.0, 0.5) * x**2


def there_and_back(rng: np.random.Generator) -> Curve:
    """Loading and unloading on one curve."""
    x = 1.0 - np.abs(np.linspace(-1.0, 1.0, _rows(rng)))
    return x, x + rng.uniform(0.0, 0.5) * x**2


def loops(rng: np.random.Generator) -> Curve:
    """Some cycles with friction, one-sided or two-sided."""
    cycles = int(rng.integers(1, 5))
    phase = np.linspace(0.0, cycles, _rows(rng, 40))
    two_sided = rng.random() < 0.5
    swing = (
        np.sin(2 * np.pi * phase)
        if two_sided
        else 0.5 - 0.5 * np.cos(2 * np.pi * phase)
    )
    return swing, swing + _bouc_wen(swing, rng.uniform(0.02, 0.2), 0.05)


def _bouc_wen(x: np.ndarray, size: float, length: float) -> np.ndarray:
    pull = np.zeros_like(x)
    for row, step in enumerate(np.diff(x), 1):
        target = size * np.sign(step)
        pull[row] = target + (pull[row - 1] - target) * np.exp(-abs(step) / length)
    return pull


def plastic_cycles(rng: np.random.Generator) -> Curve:
    """Cycles of growing amplitude far beyond yield."""
    cycles = int(rng.integers(2, 8))
    phase = np.linspace(0.0, cycles, _rows(rng, 100))
    x = np.sin(2 * np.pi * phase) * (0.1 + phase / cycles)
    return x, 0.05 * x + _bouc_wen(x, 0.5, rng.uniform(0.05, 0.2))


def pinched_loops(rng: np.random.Generator) -> Curve:
    """Cycles that slip about zero and lose strength, as joints do."""
    cycles = int(rng.integers(2, 8))
    phase = np.linspace(0.0, cycles, _rows(rng, 150))
    x = np.sin(2 * np.pi * phase) * (0.2 + phase / cycles)
    worn = 1.0 - 0.3 * phase / cycles
    return x, worn * (x**3 / (0.3 + x**2)) + _bouc_wen(x, 0.05, 0.1)


def holds(rng: np.random.Generator) -> Curve:
    """Steps of the deformation, each held while the force relaxes or creeps."""
    steps, length = int(rng.integers(4, 12)), int(rng.integers(8, 60))
    ramp_rows = max(4, length // 3)
    levels = np.r_[np.linspace(0, 1, steps + 1), np.linspace(1, 0, steps + 1)[1:]]
    x, eased = [np.zeros(1)], [np.zeros(1)]
    share = rng.uniform(0.0, 0.08)
    for low, high in pairwise(levels):
        x += [np.linspace(low, high, ramp_rows + 1)[1:], np.full(length, high)]
        decay = 1.0 - np.exp(-np.arange(length) / (0.3 * length))
        eased += [np.zeros(ramp_rows), share * high * decay]
    deformation = np.concatenate(x)
    return deformation, deformation - np.concatenate(eased)


def hand_steps(rng: np.random.Generator) -> Curve:
    """Some uneven steps by hand, up or up and down."""
    rows = int(rng.integers(5, 25))
    x = np.cumsum(rng.uniform(0.3, 1.7, rows))
    x = (x - x[0]) / (x[-1] - x[0])
    if rng.random() < 0.5:
        x = np.r_[x, x[-2::-1]]
    return x, x + rng.uniform(0.0, 0.3) * x**2 + _bouc_wen(x, 0.03, 0.05)


def knee(rng: np.random.Generator) -> Curve:
    """A curve with a contact, a preload or a yield, each within few rows."""
    x = 1.0 - np.abs(np.linspace(-1.0, 1.0, _rows(rng)))
    place, ratio = rng.uniform(0.1, 0.7), 10 ** rng.uniform(-1.5, 1.0)
    return x, x + (ratio - 1.0) * np.maximum(x - place, 0.0)


def relaxing(rng: np.random.Generator) -> Curve:
    """A viscous part: a ramp, a long hold, and back."""
    rows = _rows(rng, 60)
    x = np.interp(np.arange(rows), [0, rows / 4, 3 * rows / 4, rows - 1], [0, 1, 1, 0])
    slow = np.zeros(rows)
    for row in range(1, rows):
        slow[row] = slow[row - 1] + (x[row] - slow[row - 1]) * 8.0 / rows
    return x, x - rng.uniform(0.0, 0.3) * slow


KINDS: tuple[Callable[[np.random.Generator], Curve], ...] = (
    ramp,
    there_and_back,
    loops,
    plastic_cycles,
    pinched_loops,
    holds,
    hand_steps,
    knee,
    relaxing,
)


def white(rng: np.random.Generator, force: np.ndarray, size: float) -> np.ndarray:
    """Independent normal noise."""
    return rng.normal(0.0, size, force.size)


def remembered(rng: np.random.Generator, force: np.ndarray, size: float) -> np.ndarray:
    """Noise of the first autoregressive order."""
    memory = rng.uniform(0.7, 0.99)
    new = rng.normal(0.0, size * np.sqrt(1.0 - memory**2), force.size)
    return lfilter([1.0], [1.0, -memory], new)


def heavy(rng: np.random.Generator, force: np.ndarray, size: float) -> np.ndarray:
    """Noise with heavy tails: t of three degrees of freedom."""
    return size * rng.standard_t(3.0, force.size)


def growing(rng: np.random.Generator, force: np.ndarray, size: float) -> np.ndarray:
    """Noise that grows with the force."""
    return rng.normal(0.0, size, force.size) * (0.1 + np.abs(force))


def rounded(rng: np.random.Generator, force: np.ndarray, size: float) -> np.ndarray:
    """Coarse digits: steps far larger than the noise."""
    step = 10.0 * size
    return np.round(force / step) * step - force


NOISES = (white, remembered, heavy, growing, rounded)


def clean_record(
    rng: np.random.Generator,
    kind: Callable[[np.random.Generator], Curve],
    noise: Callable[[np.random.Generator, np.ndarray, float], np.ndarray],
) -> Record:
    """Return a record without a fault, of one to three runs."""
    runs = int(rng.choice([1, 1, 1, 2, 3]))
    curves = [kind(rng) for _ in range(runs)]
    size = 10 ** rng.uniform(-4.0, -1.7)
    x = np.concatenate([x + rng.normal(0.0, 0.01) * (runs > 1) for x, _ in curves])
    zeros = rng.normal(0.0, 0.05, runs) * (runs > 1)
    y = np.concatenate(
        [
            y + noise(rng, y, size) + zero
            for (_, y), zero in zip(curves, zeros, strict=True)
        ]
    )
    sign = rng.choice([-1.0, 1.0])
    scales = 10 ** rng.uniform(-2.0, 2.0), 10 ** rng.uniform(-2.0, 4.0)
    origins = rng.normal(0.0, 5.0, 2) * (rng.random() < 0.5)
    x, y = (
        sign * scale * (values + origin)
        for scale, values, origin in zip(scales, (x, y), origins, strict=True)
    )
    step = scales[0] * 10 ** rng.uniform(-5.0, -2.5)
    x = np.round(x / step) * step
    run = np.repeat(np.arange(runs), [c[0].size for c in curves])
    time = np.concatenate([np.arange(c[0].size) for c in curves]) * 0.1
    return Record(x, y, time, run)
