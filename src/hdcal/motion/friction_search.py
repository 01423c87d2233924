"""Where the density of a record with dry friction has its mode.

The response with dry friction is continuous in its parameters but bent wherever one
more swing begins, and a record that ends at rest has a peak of the density for each
number of swings. A search begins with the largest swings alone, whose envelope has one
peak, and takes the rest along step by step.
"""

from dataclasses import replace

import jax
import numpy as np

from hdcal.data.prior import Prior
from hdcal.exported import jit
from hdcal.inference import laplace
from hdcal.inference.distributions import frozen
from hdcal.inference.identifiability import standard_error
from hdcal.motion.dynamic_priors import FRICTION
from hdcal.motion.dynamic_problem import (
    STOP,
    DynamicProblem,
    predict_motion,
    stopping_distance,
)

# Shares of the largest swing down to which the record is looked at, one by one.
_SHARES = (0.5, 0.25, 0.1)
# Shares of the loss that a search begins with as friction.
_LITTLE, _MUCH = (0.005, 0.05, 0.2), 0.5
# Share of a prior outside of which no search begins.
_TAIL = 1e-3


class FrictionSearch:
    """Where the searches with dry friction begin: at the mode of the linear model."""

    def __init__(self, viscous: DynamicProblem, mode, both: DynamicProblem):
        values = laplace.values_at(viscous, mode.centre)
        self.values = values
        self.sites = laplace.sites_at(viscous, mode.centre)
        self.equivalent = equivalent_friction(viscous, values)
        self.counts = _counts(viscous, float(values["natural_frequency"]))
        self.both = _resolved(both, values)
        without = {**both.priors, "damping_ratio": Prior("fixed", (0.0,))}
        self.dry = replace(self.both, priors=without)

    def fit_both(self) -> laplace.Whitening:
        """Search from little friction at once, and from much of it by stages."""
        shares = {share: self._shared(share) for share in (*_LITTLE, _MUCH)}
        fits = [laplace.fit(self.both, shares[s]) for s in _LITTLE]
        fits.append(_fit_by_stages(self.both, shares[_MUCH], self.counts))
        levels = [float(laplace.potential(self.both, fit.centre)) for fit in fits]
        return fits[int(np.nanargmin(levels))]

    def fit_dry(self) -> laplace.Whitening:
        """Search from all of the loss as friction."""
        whole = self._at(self.dry, self.equivalent)
        return _fit_by_stages(self.dry, whole, self.counts)

    def _shared(self, share: float) -> dict[str, float]:
        """Return where to start with a share of the loss as friction."""
        ratio = (1.0 - share) * self.sites.get("damping_ratio", 0.0)
        changed = {"damping_ratio": _inside(self.both.priors["damping_ratio"], ratio)}
        return self._at(self.both, share * self.equivalent, changed)

    def _at(self, problem: DynamicProblem, friction: float, changed=None) -> dict:
        """Return the sites to start from with a friction [N]."""
        sites = self.sites | (changed or {}) | _friction_site(problem, friction)
        known = problem.priors
        if known["initial_deformation"].family == "normal":
            distance = stopping_distance(problem, self.values | {FRICTION: friction})
            sites[STOP] = sites.pop("initial_deformation") + float(distance)
        return {
            name: value
            for name, value in sites.items()
            if name not in known or known[name].family != "fixed"
        }


def motion_slopes(problem: DynamicProblem, values) -> dict[str, np.ndarray]:
    """Return the derivative of the mean reading by each free parameter, (rows,)."""
    free = {
        name: values[name]
        for name, prior in problem.priors.items()
        if prior.family != "fixed" and name != "deformation_sigma"
    }
    slopes = _slopes(problem, values, free)
    return {n: np.asarray(slope)[: problem.count] for n, slope in slopes.items()}


@jit
def _slopes(problem: DynamicProblem, values, free):
    def mean(moved):
        return predict_motion(problem, {**values, **moved})

    return jax.jacfwd(mean)(free)


predict = jit(predict_motion)


def swing(problem: DynamicProblem, values) -> float:
    """Return the largest swing: half the range of the modelled deformation [mm]."""
    return 0.5 * float(np.ptp(np.asarray(predict(problem, values))[: problem.count]))


def dry_share(friction, damping, frequency, swing):
    """Return the share of the energy of a swing that dry friction takes [-].

    4 f A against π c ω A² of a free swing of amplitude A.

    Args:
        friction: f [N].
        damping: c [N·s/mm].
        frequency: ω/2π [Hz].
        swing: A [mm].
    """
    dry = 4.0 * friction
    return dry / (dry + 2.0 * np.pi**2 * damping * frequency * swing)


def equivalent_friction(problem: DynamicProblem, values) -> float:
    """Return the friction that takes of the largest swing what damping does [N]."""
    pace = 2.0 * np.pi * float(values["natural_frequency"])
    return 0.25 * np.pi * float(values["damping"]) * pace * swing(problem, values)


def rubbing_contrast(viscous: DynamicProblem, frictional: DynamicProblem, values):
    """Return how far a gear that only rubs lies from the linear model [noise sds].

    It loses of the largest swing what the linear gear does; what other parameters of
    that would make up for is taken off, to first order.

    Args:
        viscous: the linear model.
        frictional: the same with dry friction.
        values: of the linear model at its mode.
    """
    friction = equivalent_friction(viscous, values)
    rubbing = {**values, "damping_ratio": 0.0, FRICTION: friction}
    away = predict(frictional, rubbing) - predict(viscous, values)
    away = np.asarray(away)[: viscous.count]
    columns = np.stack(list(motion_slopes(viscous, values).values()), axis=1)
    columns = columns / (np.linalg.norm(columns, axis=0) + 1e-300)
    away = away - columns @ np.linalg.lstsq(columns, away, rcond=None)[0]
    return float(np.linalg.norm(away) / values["deformation_sigma"])


def _counts(problem: DynamicProblem, frequency: float) -> list[int]:
    """Return up to which rows a search looks, one after the other; all at the end."""
    read = np.asarray(problem.deformation)[: problem.count]
    step = float(np.median(np.diff(problem.time[: problem.count])))
    period = int(np.clip(round(1.0 / (frequency * step)), 2, len(read)))
    windows = np.lib.stride_tricks.sliding_window_view(read, period)
    sizes = np.ptp(windows, axis=1)
    ends = {int(np.flatnonzero(sizes >= s * sizes.max())[-1]) + period for s in _SHARES}
    return sorted({*ends, problem.count})


def _fit_by_stages(problem: DynamicProblem, start, counts) -> laplace.Whitening:
    """Return the mode, found in the first rows first.

    Args:
        problem: data and priors.
        start: sites whose value to start from.
        counts: of the rows looked at, all of them last.
    """
    for count in counts[:-1]:
        part = replace(problem, count=count)
        start = laplace.sites_at(part, laplace.fit(part, start).centre)
    return laplace.fit(problem, start)


def _friction_site(problem: DynamicProblem, size: float) -> dict[str, float]:
    """Return the sampled site of the friction at a size [N]."""
    prior = problem.priors[FRICTION]
    if prior.family == "fixed":
        return {}
    if FRICTION in problem.units:
        ratio = max(size / problem.units[FRICTION], 1e-6)
        return {f"_{FRICTION}": float(ratio + np.log(-np.expm1(-ratio)))}
    return {FRICTION: _inside(prior, size)}


def _inside(prior: Prior, value: float) -> float:
    """Return the value, or what is nearest to it in the support of its prior.

    Outside of it there is no density to climb.
    """
    if prior.family == "fixed":
        return value
    return float(np.clip(value, *frozen(prior).ppf([_TAIL, 1.0 - _TAIL])))


def _resolved(problem: DynamicProblem, values) -> DynamicProblem:
    """Return the problem with the unit of friction that the data resolve.

    Args:
        problem: with dry friction.
        values: of the linear model at its mode.
    """
    if FRICTION not in problem.units:
        return problem
    widest = problem.units[FRICTION]
    values = {**values, FRICTION: 1e-3 * widest}
    slopes = motion_slopes(problem, values)
    column = slopes.pop(FRICTION)
    columns = np.stack(list(slopes.values()), axis=1)
    columns = columns / (np.linalg.norm(columns, axis=0) + 1e-300)
    noise = float(values["deformation_sigma"])
    unit = standard_error(column, columns, noise, widest)
    return replace(problem, units={FRICTION: unit})
