"""Search for the mode of the dynamic density, which has many peaks.

The density of an oscillation has a narrow peak at its frequency and lower ones beside
it. At a given frequency and damping the linear model is linear in the other parameters,
so a scan by least squares shows all peaks.
"""

from dataclasses import replace

import jax
import numpy as np
from scipy.optimize import minimize

from hdcal.inference import laplace
from hdcal.inference.checks import Check
from hdcal.inference.distributions import frozen, moments
from hdcal.inference.force_model.padding import measured
from hdcal.inference.laplace import Whitening
from hdcal.motion.dynamic_problem import DynamicProblem, stiffness_shares
from hdcal.physics.linear_response import fit_linear

ONE_FREQUENCY = "one natural frequency explains the data"
# A second peak less than this below the first [nat] may hold a part of the posterior;
# peaks nearer than this share of one over the duration are one.
_PEAKS, _RIVAL, _SAME = 3, 7.0, 0.05
# Error of the top of a peak [nat].
_CLOSE = 1e-3
_RATIOS = np.array([0.005, 0.03, 0.2])
# Step of the scan as a share of one over the duration, and its number of frequencies.
_FINENESS, _FEWEST, _MOST = 0.25, 60, 6000
# Rows that are scanned, of long records those of the largest spread; and rows of all
# fits that are computed at once.
_WINDOW, _AT_ONCE = 2048, 262_144
# Parts of a prior outside of which no search begins.
_TAILS = 1e-3, 1.0 - 1e-3


def highest_peak(problem: DynamicProblem) -> tuple[Whitening, Check]:
    """Return the highest peak of the linear model, and a check of the next one.

    Chains start around one peak and do not cross to another: R-hat would not show it.
    """
    window = _window(problem)
    # The whole record resolves the frequency more finely than the scan of a window.
    parts = [window] if window is problem else [window, problem]
    peaks = _scan(window)
    for part in parts:
        peaks = [_refined(part, place) for place in peaks]
    width = _SAME / np.ptp(problem.time[: problem.count])
    peaks = sorted(peaks, key=lambda peak: _misfit(problem, peak))
    mode = laplace.fit(problem, _start(problem, peaks[0]) if peaks else None)
    rivals = [p for p in peaks[1:] if abs(p[0] - peaks[0][0]) > width]
    if not rivals:
        words = "all searches find the same frequency"
        return mode, Check(ONE_FREQUENCY, "passed", words)
    drop = _misfit(problem, rivals[0]) - _misfit(problem, peaks[0])
    words = f"the next one has a log likelihood {drop:.0f} lower; at least "
    words += f"{_RIVAL:g} is needed"
    return mode, Check(ONE_FREQUENCY, "passed" if drop >= _RIVAL else "failed", words)


def _scan(problem: DynamicProblem) -> list[np.ndarray]:
    """Return frequency [Hz] and damping ratio at the highest peaks, best first."""
    frequency = _frequencies(problem)
    places = np.stack(np.meshgrid(frequency, _RATIOS, indexing="ij"), -1)
    left, _ = _fit_all(problem, places.reshape(-1, 2))
    left = left.reshape(places.shape[:2])
    level = np.pad(left.min(axis=1), 1, constant_values=np.inf)
    is_peak = (level[1:-1] <= level[:-2]) & (level[1:-1] <= level[2:])
    peaks = np.flatnonzero(is_peak & np.isfinite(level[1:-1]))
    peaks = peaks[np.argsort(level[1:-1][peaks], kind="stable")][:_PEAKS]
    return [*places[peaks, np.argmin(left[peaks], axis=1)]]


def _refined(problem: DynamicProblem, place: np.ndarray) -> np.ndarray:
    """Return frequency [Hz] and damping ratio at the top of a peak."""
    step = 0.5 * _FINENESS / (np.ptp(problem.time[: problem.count]) * place[0])
    simplex = np.log(place) + np.array([[0.0, 0.0], [step, 0.0], [0.0, 0.5]])
    options = {"initial_simplex": simplex, "fatol": _CLOSE, "xatol": np.inf}
    found = minimize(
        lambda log: _misfit(problem, np.exp(log)),
        simplex[0],
        method="Nelder-Mead",
        options=options,
    )
    return np.exp(found.x)


def _misfit(problem: DynamicProblem, place: np.ndarray) -> float:
    """Return −log likelihood of the best fit at a place, up to a constant [nat]."""
    (left,), _ = _fit_all(problem, place[None])
    return 0.5 * problem.count * float(np.log(left))


@jax.jit
def _fits(problem: DynamicProblem, shares, places):
    rows = len(problem.time)
    real = measured(rows, problem.count)
    data = problem.time, problem.force, problem.deformation, real, shares
    size = max(_AT_ONCE // rows, 1)
    return jax.lax.map(lambda at: fit_linear(at, *data), places, batch_size=size)


def _fit_all(problem: DynamicProblem, places: np.ndarray):
    """Return what `fit_linear` does at frequencies [Hz] and damping ratios, (m, 2)."""
    shares = stiffness_shares(problem, moments(problem.priors["alpha"], "alpha")[0])
    return map(np.asarray, _fits(problem, shares, places))


def _window(problem: DynamicProblem) -> DynamicProblem:
    """Return the window of a long record in which the deformation varies most."""
    if problem.count <= _WINDOW:
        return problem
    starts = range(0, problem.count - _WINDOW + 1, _WINDOW // 2)
    read = np.asarray(problem.deformation)
    first = max(starts, key=lambda row: np.std(read[row : row + _WINDOW]))
    names = [n for n in ("time", "force", "change") if getattr(problem, n) is not None]
    rows = slice(first, first + _WINDOW)
    parts = {name: np.asarray(getattr(problem, name))[rows] for name in names}
    return replace(problem, deformation=read[rows], count=_WINDOW, **parts)


def _frequencies(problem: DynamicProblem) -> np.ndarray:
    """Return the frequencies that priors allow and the sampling resolves [Hz]."""
    soft, stiff = problem.unit_stiffness * _ends(problem, "K") * _ends(problem, "E0")
    light, heavy = _ends(problem, "mass")
    time = problem.time[: problem.count]
    high = min(np.sqrt(stiff / light), np.pi / np.median(np.diff(time)))
    low = min(np.sqrt(soft / heavy), 0.5 * high)
    width = _FINENESS * 2.0 * np.pi / (time[-1] - time[0])
    count = int(np.clip((high - low) / width, _FEWEST, _MOST))
    return np.linspace(low, high, count) / (2.0 * np.pi)


def _ends(problem: DynamicProblem, name: str) -> np.ndarray:
    """Return positive numbers between which a prior has nearly all of its mass."""
    prior = problem.priors[name]
    if prior.family == "fixed":
        return np.full(2, float(prior.numbers[0]))
    return np.maximum(frozen(prior, name).ppf(_TAILS), 1e-9)


def _start(problem: DynamicProblem, place: np.ndarray) -> dict[str, float]:
    """Return sites at a frequency [Hz] and damping ratio, from all rows."""
    (left,), ((flexibility, deformation, velocity, offset),) = _fit_all(
        problem, place[None]
    )
    modulus = float(np.mean(_ends(problem, "E0")))
    values = {
        "E0": modulus,
        "K": 1.0 / (flexibility * modulus * problem.unit_stiffness),
        "mass": 1.0 / (flexibility * (2.0 * np.pi * place[0]) ** 2),
        "damping_ratio": place[1],
        "initial_deformation": deformation,
        "initial_velocity": velocity,
        "deformation_offset": offset,
        "deformation_sigma": max(np.sqrt(left / problem.count), 1e-6),
    }
    return _as_sites(problem, values)


def _as_sites(problem: DynamicProblem, values) -> dict[str, float]:
    """Return values as sites of the sampler, inside the support of their priors."""
    sites = {}
    for name, value in values.items():
        prior = problem.priors[name]
        if prior.family in ("uniform", "beta"):
            value = np.clip(value, *frozen(prior, name).ppf(_TAILS))
        if prior.family != "fixed":
            scale = values["E0"] if name == "K" else 1.0
            sites["_KE0" if name == "K" else name] = float(value * scale)
    return sites
