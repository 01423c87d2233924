"""The base model of a case: point of expansion, columns and prior of the stiffness."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from hdcal.data.case import Case
from hdcal.data.gear_file.certificates import GAINS
from hdcal.data.prior import Prior
from hdcal.data.records import Records
from hdcal.inference import distributions
from hdcal.physics.chain import Base, Reading
from hdcal.physics.theory import THEORIES

# Prior sd of a fixed parameter.
_FIXED = 1e-9


def moments(priors: Mapping[str, Prior], name: str) -> tuple[float, float]:
    """Return mean and sd of a parameter; the sd of a fixed one is tiny."""
    mean, sd = distributions.moments(priors[name], name)
    return mean, sd or _FIXED


def stiffness_prior(
    case: Case, priors: Mapping[str, Prior]
) -> tuple[float, float, float]:
    """Return mean and sd of the log stiffness as read [N/mm], and that at K = 1.

    The sd has the gauge gains in it.
    """
    (log_k, k_sd), (log_e, e_sd) = (_log_moments(priors, name) for name in ("K", "E0"))
    formula = float(THEORIES[case.gear.theory](case.gear.geometry, np.exp(log_e)))
    gains = [moments(priors, name)[1] for name in GAINS if name in priors]
    sd = float(np.linalg.norm([k_sd, e_sd, *gains]))
    return log_k + float(np.log(formula)), sd, formula


def _log_moments(priors: Mapping[str, Prior], name: str) -> tuple[float, float]:
    """Return mean and sd of the logarithm of a positive parameter."""
    prior = priors[name]
    if prior.family == "lognormal":
        return float(np.log(prior.numbers[0])), float(prior.numbers[1])
    mean, sd = moments(priors, name)
    return float(np.log(mean)), sd / mean


def base_at(
    records: Records,
    reading: Reading,
    priors: Mapping[str, Prior],
    noise_sd: float,
    stiffness: float | None,
    expected: float,
) -> Base:
    """Return the base parameters, the stiffness by least squares unless given."""
    names = ("alpha", "deformation_offset", "force_offset")
    alpha, zero, offset = (moments(priors, name)[0] for name in names)
    if stiffness is None:
        rise = np.asarray(records.temperature) - reading.reference_temperature
        radial = (np.asarray(records.deformation) - zero) * reading.radial_per_read
        shape = radial * (1.0 - alpha * rise)
        design = np.stack([shape, np.ones_like(shape)], axis=1)
        force = np.asarray(records.force)
        stiffness = float(np.linalg.lstsq(design, force, rcond=None)[0][0])
    stiffness = stiffness if stiffness > 0.0 else float(expected)
    return Base(stiffness, alpha, zero, offset, noise_sd)


def base_columns(
    records: Records,
    reading: Reading,
    priors: Mapping[str, Prior],
    base: Base,
    log_sd: float,
) -> Float[np.ndarray, "n 4"]:
    """Return the change of each row by one prior sd of each base parameter [N]."""
    rise = np.asarray(records.temperature) - reading.reference_temperature
    per_read, stiffness = reading.radial_per_read, float(base.stiffness)
    radial = (np.asarray(records.deformation) - base.deformation_offset) * per_read
    soft = 1.0 - base.alpha * rise
    columns = [
        stiffness * (log_sd * radial * soft),
        np.full(len(rise), moments(priors, "force_offset")[1]),
        stiffness * (-moments(priors, "alpha")[1] * rise * radial),
        stiffness * (-moments(priors, "deformation_offset")[1] * per_read * soft),
    ]
    return np.stack(columns, axis=1)


def run_columns(records: Records) -> Float[np.ndarray, "n r"]:
    """Return the contrasts of the force offsets of runs with their mean [N].

    Their prior sd is the largest force: so wide that it favours no hypothesis.
    """
    runs, run = np.unique(records.run, return_inverse=True)
    contrasts = np.eye(len(runs))[:, 1:] - 1.0 / len(runs)
    return float(np.max(np.abs(records.force))) * contrasts[run]
