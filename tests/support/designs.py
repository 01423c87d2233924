"""Draws of gears for the tests of designs."""

from dataclasses import replace

import numpy as np
from rigs import make_gear

from hdcal.data.prior import Prior
from hdcal.design.design_draws import DesignDraws, design_draws
from hdcal.physics.effects.stiffness import ProgressiveStiffening


def known(draws: int = 2000, theory="ring") -> DesignDraws:
    """Return draws of a gear whose K is lognormal and whose modulus is known."""
    gear = make_gear(
        theory=theory,
        K=Prior("lognormal", (2.2, 0.05)),
        E0=Prior("fixed", (207e3,)),
        alpha=Prior("normal", (3e-4, 2e-5)),
    )
    return design_draws(gear, draws=draws)


def bent(draws: int = 500, theory="ring") -> DesignDraws:
    """Return draws of a gear that gets stiffer as it is deformed."""
    own = known(draws, theory)
    slope = np.random.default_rng(1).normal(0.35, 0.05, draws)
    return replace(
        own,
        problem=replace(own.problem, effects=(ProgressiveStiffening,)),
        values={**own.values, "progressive_stiffening.slope": slope},
    )
