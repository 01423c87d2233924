"""Gears for the tests of designs."""

import numpy as np
from posteriors import plain_draws, ramp_case, written_posterior
from rigs import make_gear

from hdcal.inference.posterior import Posterior


def known(draws: int = 2000, theory="ring", log_sd: float = 0.05) -> Posterior:
    """Return a gear whose K is lognormal, whose modulus is known, without zeros."""
    rng, case = np.random.default_rng(0), ramp_case(make_gear(theory=theory))
    plain = plain_draws(case, draws)
    unit = plain["stiffness"] / (plain["K"] * plain["E0"])
    influence = 2.2 * np.exp(log_sd * rng.normal(size=draws))
    zero, modulus = np.zeros(draws), np.full(draws, 207e3)
    own = {"K": influence, "E0": modulus, "stiffness": influence * modulus * unit}
    own |= {"alpha": rng.normal(3e-4, 2e-5, draws)}
    own |= {"force_offset": zero, "deformation_offset": zero}
    return written_posterior(case, plain | own)


def calibrated(size: int, effect: str, **changed) -> Posterior:
    """Return a calibrated gear with an effect, and other values of its sites."""
    case = ramp_case(known={"readings of the rig alone", "unloading"})
    draws = plain_draws(case, size) | {
        name.replace("__", "."): np.broadcast_to(values, size)
        for name, values in changed.items()
    }
    return written_posterior(case, draws, effects=[effect])


def bent(draws: int = 500, slope: float = 0.35) -> Posterior:
    """Return a calibrated gear that gets stiffer as it is deformed."""
    slopes = np.random.default_rng(1).normal(slope, 0.05, draws)
    return calibrated(
        draws, "progressive_stiffening", progressive_stiffening__slope=slopes
    )
