"""Draws of gears for the tests of designs."""

import numpy as np
from posteriors import plain_draws, ramp_case, written_posterior
from rigs import make_gear

from hdcal.data.prior import Prior
from hdcal.design.gears import Gears, draw_gears


def known(draws: int = 2000, theory="ring") -> Gears:
    """Return a gear file whose K is lognormal and whose modulus is known."""
    gear = make_gear(
        theory=theory,
        K=Prior("lognormal", (2.2, 0.05)),
        E0=Prior("fixed", (207e3,)),
        alpha=Prior("normal", (3e-4, 2e-5)),
    )
    return draw_gears(gear, count=draws)


def calibrated(size: int, effect: str, **changed) -> Gears:
    """Return a calibrated gear with an effect, and other values of its sites."""
    case = ramp_case(known={"bare_rig", "unloading"})
    draws = plain_draws(case, size) | {
        name.replace("__", "."): np.broadcast_to(values, size)
        for name, values in changed.items()
    }
    return draw_gears(written_posterior(case, draws, effects=[effect]))


def bent(draws: int = 500, slope: float = 0.35) -> Gears:
    """Return a calibrated gear that gets stiffer as it is deformed."""
    slopes = np.random.default_rng(1).normal(slope, 0.05, draws)
    return calibrated(
        draws, "progressive_stiffening", progressive_stiffening__slope=slopes
    )
