"""What is known of a stream before its first row, from a posterior or from priors."""

from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Gear
from hdcal.data.priors import Prior
from hdcal.inference.density import POSITIVE
from hdcal.inference.distributions import bounds, frozen, scaled
from hdcal.inference.posterior import Posterior
from hdcal.inference.problem import Problem
from hdcal.physics.chain import Base, Reading, linear_coefficients
from hdcal.physics.theory import THEORIES

_PRIOR_DRAWS = 20_000
_SITES = ("K", "E0", "alpha", "force_offset", "deformation_offset", "sigma")


@dataclass(frozen=True)
class Beginning:
    """Draws of the force model for a gear on a mounting that was not tested.

    Attributes:
        base: parameters of the model, each (draw,).
        variance: of a reading, rounding and stated errors included [N²], (draw,).
        reading: how the rig reads.
        remounting: variance of the force's zero from one mounting to the next [N²].
    """

    base: Base
    variance: np.ndarray
    reading: Reading
    remounting: float

    def coefficients(self) -> np.ndarray:
        """Return the coefficients of the linear columns, shape (draw, 4)."""
        return np.asarray(linear_coefficients(self.base, self.reading))


def of_posterior(posterior: Posterior, seed: int = 0) -> Beginning:
    """Return what a posterior says of the stream.

    The stream's mounting is a new one, with a zero of its own; where several gears
    were tested its gear is a new one too.

    Args:
        posterior: of a calibration that may be used.
        seed: of the new mounting and gear.
    """
    draws, problem = posterior.draws, posterior.problem
    rng, size = np.random.default_rng(seed), len(draws["K"])
    stiffness = draws["K"] * draws["E0"] * float(problem.unit_stiffness)
    if problem.specimens:
        sd = draws["specimen_sd"] * np.sqrt(1.0 + 1.0 / problem.specimens)
        stiffness = stiffness * (1.0 + sd * rng.standard_normal(size))
    of_run = _draw(posterior.priors["run_offset_sd"], rng, size)
    if problem.runs:
        of_run = draws["run_offset_sd"] * np.sqrt(1.0 + 1.0 / problem.runs)
    known = float(np.mean(np.asarray(posterior.case.records.force_sd) ** 2))
    base = Base(
        stiffness=stiffness,
        alpha=draws["alpha"],
        deformation_offset=draws["deformation_offset"],
        force_offset=draws["force_offset"] + of_run * rng.standard_normal(size),
        sigma=draws["sigma"],
    )
    step = float(problem.step)
    variance = draws["sigma"] ** 2 + step**2 / 12.0 + known
    return Beginning(base, variance, _plain(problem), 2.0 * float(np.mean(of_run**2)))


def _plain(problem: Problem) -> Reading:
    reading = problem.reading
    return Reading(float(reading.radial_per_read), float(reading.reference_temperature))


def of_gear(gear: Gear, seed: int = 0) -> Beginning:
    """Return what the priors of a gear file say of the stream.

    Args:
        gear: from `read_gear`.
        seed: of the draws.
    """
    rng = np.random.default_rng(seed)
    own, meant = (
        float(THEORIES[name](gear.geometry, 1.0))
        for name in (gear.theory, gear.K_theory)
    )
    priors = {**gear.priors, "K": scaled(gear.priors["K"], meant / own)}
    draws = {n: _draw(priors[n], rng, _PRIOR_DRAWS, n in POSITIVE) for n in _SITES}
    of_run = _draw(gear.scale_priors["run_offset_sd"], rng, _PRIOR_DRAWS)
    base = Base(
        stiffness=draws["K"] * draws["E0"] * own,
        alpha=draws["alpha"],
        deformation_offset=draws["deformation_offset"],
        force_offset=draws["force_offset"],
        sigma=draws["sigma"],
    )
    half = 0.5 if gear.reading == "diametral" else 1.0
    variance = draws["sigma"] ** 2 + gear.force_resolution**2 / 12.0
    reading = Reading(half, gear.reference_temperature)
    return Beginning(base, variance, reading, 2.0 * float(np.mean(of_run**2)))


def _draw(prior: Prior, rng, size: int, positive: bool = False) -> np.ndarray:
    if prior.family == "fixed":
        return np.full(size, float(prior.numbers[0]))
    law = frozen(prior)
    low = float(law.cdf(0.0)) if positive and bounds(prior)[0] < 0.0 else 0.0
    return np.asarray(law.ppf(low + (1.0 - low) * rng.random(size)))
