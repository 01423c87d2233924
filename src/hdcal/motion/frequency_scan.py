"""Where the search begins: a scan over natural frequencies.

The likelihood of an oscillation has a narrow peak at its frequency and lower ones
beside it. Given frequency and damping the model is linear in what is left, so a scan
by least squares sees all peaks.
"""

import jax
import jax.numpy as jnp
import numpy as np

from hdcal.data.priors import Prior
from hdcal.exported import jit
from hdcal.inference.distributions import frozen
from hdcal.inference.padding import measured
from hdcal.motion.dynamic_problem import DynamicProblem, step_stiffness, stretch
from hdcal.physics.linear_response import LinearGear, linear_response

_RATIOS = np.array([0.005, 0.03, 0.2])
# Frequencies are scanned in steps of this share of one over the duration.
_FINENESS = 0.25
_MOST, _FEWEST, _BLOCK = 6000, 60, 64
_TAIL = 1e-3
# Longer records are scanned in a window of so many rows, then near its peaks in whole.
_WINDOW, _WHOLE_BLOCK = 2048, 4
_NEAR = np.linspace(-1.0, 1.0, 9)


@jit
def _residual(problem: DynamicProblem, frequency, ratio):
    """Return the residual sum of squares, and 1/k, y₀, ẏ₀ and zero of the best fit."""
    real = measured(len(problem.time), problem.count)
    read = jnp.where(real, problem.deformation, 0.0)
    alpha = problem.priors["alpha"]
    stated = alpha.family in ("fixed", "normal", "lognormal")
    middle = {"alpha": alpha.numbers[0] if stated else 0.0}
    softening = step_stiffness(problem, middle, 1.0)

    def one(frequency, ratio):
        # A mass of one over ω² has a mean stiffness of one.
        pace = 2.0 * jnp.pi * frequency
        gear, time = LinearGear(pace**-2, 2.0 * ratio / pace, softening), problem.time
        none = jnp.zeros_like(problem.force)
        at_rest, moved = jnp.zeros(2), jnp.array([1.0, 0.0])
        columns = jnp.stack(
            [
                linear_response(gear, time, problem.force, at_rest)[:, 0],
                linear_response(gear, time, none, moved)[:, 0],
                linear_response(gear, time, none, jnp.stack([0.0, pace]))[:, 0],
                jnp.ones_like(none),
            ],
            axis=1,
        )
        columns = jnp.where(real[:, None], columns, 0.0)
        size = jnp.linalg.norm(columns, axis=0) + 1e-300
        design = columns / size
        normal = design.T @ design + 1e-10 * jnp.eye(4)
        weights = jnp.linalg.solve(normal, design.T @ read)
        left = read - design @ weights
        found = weights / size * jnp.array([1.0, 1.0, pace, 1.0])
        # A gear gives way in the direction of the force, or it is none.
        return jnp.where(found[0] > 0.0, left @ left, jnp.inf), found

    return jax.vmap(one)(frequency, ratio)


def scan(problem: DynamicProblem, count: int) -> list[dict[str, float]]:
    """Return where to start, best first: values of sites at the highest peaks.

    Args:
        problem: data and priors.
        count: how many peaks at most.
    """
    window = _liveliest(problem)
    frequency = _frequencies(window)
    grid = np.stack(np.meshgrid(frequency, _RATIOS, indexing="ij"), axis=-1)
    left, found = _residuals(window, grid.reshape(-1, 2), _BLOCK)
    best = np.argmin(left.reshape(grid.shape[:2]), axis=1)
    rows = np.arange(len(frequency)) * len(_RATIOS) + best
    rows = rows[np.isfinite(left[rows])]
    level = np.pad(left[rows], 1, constant_values=np.inf)
    peaks = rows[(level[1:-1] <= level[:-2]) & (level[1:-1] <= level[2:])]
    peaks = peaks[np.argsort(left[peaks], kind="stable")][:count]
    places = grid.reshape(-1, 2)
    if window is problem:
        return [_values(problem, places[i], found[i], left[i]) for i in peaks]
    step = frequency[1] - frequency[0]
    return [_refined(problem, places[i], step) for i in peaks]


def _residuals(problem: DynamicProblem, places: np.ndarray, block: int):
    """Return what `_residual` does at every frequency and ratio, in bounded memory.

    Args:
        problem: data and priors.
        places: frequency [Hz] and damping ratio, shape (m, 2).
        block: how many at once; blocks of one shape are compiled once.
    """
    padded = np.pad(places, ((0, -len(places) % block), (0, 0)), mode="edge")
    parts = [
        _residual(problem, part[:, 0], part[:, 1])
        for part in padded.reshape(-1, block, 2)
    ]
    left = np.concatenate([np.asarray(p[0]) for p in parts])[: len(places)]
    found = np.concatenate([np.asarray(p[1]) for p in parts])[: len(places)]
    return left, found


def _liveliest(problem: DynamicProblem) -> DynamicProblem:
    """Return the window of a long record in which the deformation varies most.

    Where a window begins the gear may be in any state: the scan leaves that open.
    """
    if problem.count <= _WINDOW:
        return problem
    starts = range(0, problem.count - _WINDOW + 1, _WINDOW // 2)
    spread = [np.std(problem.deformation[i : i + _WINDOW]) for i in starts]
    return stretch(problem, starts[int(np.argmax(spread))], _WINDOW)


def _refined(problem: DynamicProblem, place: np.ndarray, step: float):
    """Return where to start near a peak of the window, from all rows.

    Args:
        problem: data and priors.
        place: frequency [Hz] and damping ratio of the peak.
        step: of the scan over the window [Hz].
    """
    place, _, _ = _best_near(problem, place, step)
    return _values(problem, *_best_near(problem, place, step * (_NEAR[1] - _NEAR[0])))


def _best_near(problem: DynamicProblem, place: np.ndarray, step: float):
    """Return the best place within a step, and what `_residual` says there."""
    near = np.tile(place, (len(_NEAR), 1))
    near[:, 0] += step * _NEAR
    left, found = _residuals(problem, near, _WHOLE_BLOCK)
    best = int(np.argmin(left))
    return near[best], found[best], left[best]


def _frequencies(problem: DynamicProblem) -> np.ndarray:
    """Return what the priors allow and the sampling can show [Hz]."""
    ends = {name: _ends(problem.priors[name], name) for name in ("K", "E0", "mass")}
    soft, stiff = ends["K"] * ends["E0"] * problem.unit_stiffness
    light, heavy = ends["mass"]
    low, high = np.sqrt(soft / heavy), np.sqrt(stiff / light)
    time = problem.time[: problem.count]
    nyquist = np.pi / np.median(np.diff(time))
    high = min(high, nyquist)
    low = min(low, 0.5 * high)
    width = _FINENESS * 2.0 * np.pi / (time[-1] - time[0])
    count = int(np.clip((high - low) / width, _FEWEST, _MOST))
    return np.linspace(low, high, count) / (2.0 * np.pi)


def _ends(prior: Prior, name: str) -> np.ndarray:
    """Return between which positive numbers the prior puts next to everything."""
    if prior.family == "fixed":
        return np.full(2, float(prior.numbers[0]))
    return np.maximum(frozen(prior, name).ppf([_TAIL, 1.0 - _TAIL]), 1e-9)


def _values(problem: DynamicProblem, place, found, left) -> dict[str, float]:
    frequency, ratio = place
    stiffness = 1.0 / found[0]
    modulus = float(np.mean(_ends(problem.priors["E0"], "E0")))
    influence = stiffness / (modulus * problem.unit_stiffness)
    values = {
        "E0": modulus,
        "_KE0": influence * modulus,
        "mass": stiffness / (2.0 * np.pi * frequency) ** 2,
        "damping_ratio": ratio,
        "initial_deformation": found[1],
        "initial_velocity": found[2],
        "deformation_offset": found[3],
        "deformation_sigma": max(np.sqrt(left / problem.count), 1e-6),
    }
    start = {}
    for name, value in values.items():
        prior = problem.priors["K" if name == "_KE0" else name]
        if prior.family == "fixed":
            continue
        if prior.family in ("uniform", "beta"):
            # Outside of its support there is no density to climb.
            scale = modulus if name == "_KE0" else 1.0
            ends = scale * frozen(prior).ppf([_TAIL, 1.0 - _TAIL])
            value = np.clip(value, *ends)
        start[name] = float(value)
    return start
