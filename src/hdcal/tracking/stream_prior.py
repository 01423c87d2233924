"""What is known of a stream before its first row, from a posterior or from priors."""

from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Gear
from hdcal.data.prior import scaled
from hdcal.inference.distributions import sample_prior
from hdcal.inference.gauges import as_read
from hdcal.physics.chain import Base, Reading, linear_coefficients
from hdcal.physics.theory import THEORIES
from hdcal.prediction.engine.pooled import Pooled

_PRIOR_DRAWS = 20_000
# Weights of a leftover below this share of the largest one have no part in a reading.
# Of a long wave the finest ones are 1e-100: too small to be told from what is known.
_NO_PART = 1e-9
_SITES = ("K", "E0", "alpha", "force_offset", "deformation_offset", "sigma")


@dataclass(frozen=True)
class StreamPrior:
    """Draws of the force model for a gear on a mounting that was not tested.

    Attributes:
        base: parameters of the model, each (draw,).
        weights: of the fitted leftover discrepancy [N], (draw, weight); none of a gear.
        variance: of a reading, rounding and stated errors included [N²], (draw,).
        cause: number of the cause behind each draw, (draw,).
        reading: how the rig reads.
        remounting: variance of the force's zero from one mounting to the next [N²].
        step: of the force as read [N], 0 = not rounded.
    """

    base: Base
    weights: np.ndarray
    variance: np.ndarray
    cause: np.ndarray
    reading: Reading
    remounting: float
    step: float

    def coefficients(self) -> np.ndarray:
        """Return the coefficients of the linear columns, shape (draw, 4 + weight)."""
        linear = np.asarray(linear_coefficients(self.base, self.reading))
        return np.concatenate([linear, self.weights], axis=1)


def prior_from_posterior(known: Pooled, seed: int = 0) -> StreamPrior:
    """Return what a posterior says of the stream.

    The stream's mounting is a new one, with a zero of its own; where several gears
    were tested its gear is a new one too.

    Args:
        known: draws of all causes.
        seed: of the new mounting and gear.
    """
    draws, problem = dict(known.values), known.problem
    rng, size = np.random.default_rng(seed), len(draws["K"])
    stiffness = draws["K"] * draws["E0"] * float(problem.unit_stiffness)
    stiffness = as_read(draws, stiffness)
    if problem.specimens:
        sd = draws["specimen_sd"] * np.sqrt(1.0 + 1.0 / problem.specimens)
        stiffness = stiffness * (1.0 + sd * rng.standard_normal(size))
    run_sd = sample_prior(known.priors["run_offset_sd"], "run_offset_sd", rng, size)
    if problem.runs:
        run_sd = draws["run_offset_sd"] * np.sqrt(1.0 + 1.0 / problem.runs)
    draws["force_offset"] = draws["force_offset"] + run_sd * rng.standard_normal(size)
    stated = float(np.mean(np.asarray(known.case.records.force_sd) ** 2))
    reading = problem.reading
    reading = Reading(
        float(reading.radial_per_read), float(reading.reference_temperature)
    )
    step, cause = float(problem.step), known.index
    return _stream_prior(stiffness, draws, stated, cause, reading, run_sd, step)


def prior_from_gear(gear: Gear, seed: int = 0) -> StreamPrior:
    """Return what the priors of a gear file say of the stream.

    Its mounting has a zero of its own, beside that of the gear file.

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
    draws = {
        name: sample_prior(priors[name], name, rng, _PRIOR_DRAWS) for name in _SITES
    }
    run_sd = sample_prior(
        gear.scale_priors["run_offset_sd"], "run_offset_sd", rng, _PRIOR_DRAWS
    )
    draws["force_offset"] += run_sd * rng.standard_normal(_PRIOR_DRAWS)
    half = 0.5 if gear.reading == "diametral" else 1.0
    reading = Reading(half, gear.reference_temperature)
    stiffness = draws["K"] * draws["E0"] * own
    step, cause = gear.force_resolution, np.zeros(_PRIOR_DRAWS, int)
    return _stream_prior(stiffness, draws, 0.0, cause, reading, run_sd, step)


def _stream_prior(
    stiffness, draws, stated, cause, reading, run_sd, step
) -> StreamPrior:
    base = Base(stiffness=stiffness, **{name: draws[name] for name in _SITES[2:]})
    weights = draws.get("gap_weights", np.empty((len(stiffness), 0)))
    size = np.sqrt(np.mean(weights**2, axis=0))
    weights = np.where(size > _NO_PART * size.max(initial=0.0), weights, 0.0)
    variance = draws["sigma"] ** 2 + stated + step**2 / 12.0
    remounting = 2.0 * float(np.mean(run_sd**2))
    return StreamPrior(base, weights, variance, cause, reading, remounting, step)
