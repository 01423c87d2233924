"""From which size on a gap is detected, by effect."""

from typing import Any

import numpy as np
from scipy.special import expit

from hdcal.blind.scoring.estimates import share
from hdcal.blind.scoring.scored_case import Cases

METHOD = (
    "Fraction detected = 5 % + 95 % logistic(s (log r - m)), 5 % being the gate's own "
    "level. Posterior on a grid, flat in m and log s: unlike a fitted maximum it stays "
    "finite where detected and undetected sizes do not overlap. r90: where the "
    "fraction is 90 %; median and 95 % interval, null beyond the sizes that were tried."
)
ALARM = 0.05
_WANTED = 0.9


def detection(cases: Cases) -> list[dict[str, Any]]:
    """Return the detection curve of every effect, of those in the library and not."""
    own = [c for c in cases if c.one_effect and c.label.r > 0.0]
    names = sorted({case.label.truth[0] for case in own})
    return [_curve(n, [c for c in own if c.label.truth[0] == n]) for n in names]


def _curve(name: str, cases: Cases) -> dict[str, Any]:
    r = np.array([case.label.r for case in cases])
    hit = np.array([case.answer.detected for case in cases], dtype=float)
    fitted = fit(r, hit)
    return {"effect": name, "n": len(cases), "points": points(r, hit), **fitted}


def points(r: np.ndarray, hit: np.ndarray) -> list[dict[str, Any]]:
    """Return the fraction detected by size, sizes within a factor of √2 together."""
    places = np.round(2.0 * np.log2(r))
    found = []
    for place in np.unique(places):
        own = places == place
        fraction = share(hit[own])
        middle = float(np.exp(np.mean(np.log(r[own]))))
        found.append({"r": middle, **fraction.plain()})
    return found


def fit(r: np.ndarray, hit: np.ndarray) -> dict[str, Any]:
    """Return the fitted curve and r90.

    Args:
        r: sizes, all positive.
        hit: whether each was detected.
    """
    low, high = float(np.log(r.min())), float(np.log(r.max()))
    middle = np.linspace(low - 2.0, high + 2.0, 121)[:, None]
    slope = np.geomspace(0.5, 20.0, 25)[None, :]
    log_chance = np.zeros((middle.size, slope.size))
    for size, seen in zip(np.log(r), hit, strict=True):
        chance = _fraction(size, middle, slope)
        log_chance += np.log(chance if seen else 1.0 - chance)
    weight = np.exp(log_chance - log_chance.max()).ravel()
    edge = np.log((_WANTED - ALARM) / (1.0 - _WANTED))
    limits = (middle + edge / slope).ravel()
    grid = np.linspace(low, high, 25)
    curves = np.array([_fraction(x, middle, slope).ravel() for x in grid])
    band = np.array([_quantiles(c, weight, (0.025, 0.975)) for c in curves])
    r90, lo, hi = _quantiles(limits, weight, (0.5, 0.025, 0.975))
    return {
        "r90": _within(r90, low, high),
        "lo": _within(lo, low, high),
        "hi": _within(hi, low, high),
        "reached": bool(r90 <= high),
        "below_all": bool(r90 < low),
        "curve": {
            "r": np.exp(grid).tolist(),
            "fraction": (curves @ weight / weight.sum()).tolist(),
            "lo": band[:, 0].tolist(),
            "hi": band[:, 1].tolist(),
        },
    }


def _fraction(log_r: float, middle: np.ndarray, slope: np.ndarray) -> np.ndarray:
    # Kept off 1, where rounding would make a single miss impossible.
    found = ALARM + (1.0 - ALARM) * expit(slope * (log_r - middle))
    return np.minimum(found, 1.0 - 1e-9)


def _quantiles(values: np.ndarray, weight: np.ndarray, shares) -> list[float]:
    order = np.argsort(values)
    total = np.cumsum(weight[order])
    return [float(values[order][np.searchsorted(total, q * total[-1])]) for q in shares]


def _within(log_r: float, low: float, high: float) -> float | None:
    """Return a size, None above all that were tried; below all, the smallest."""
    return None if log_r > high else float(np.exp(max(log_r, low)))
