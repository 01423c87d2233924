"""Make-believe knowledge of gears, for the tests of designs."""

from dataclasses import replace

import numpy as np
from rigs import make_gear

from hdcal.data.prior import Prior
from hdcal.design.design_draws import Basis, basis_of
from hdcal.physics.effects.progressive_stiffening import ProgressiveStiffening


def known(draws: int = 2000, theory="ring") -> Basis:
    """Return draws of a gear whose K is lognormal and whose modulus is known."""
    gear = make_gear(
        theory=theory,
        K=Prior("lognormal", (2.2, 0.05)),
        E0=Prior("fixed", (207e3,)),
        alpha=Prior("normal", (3e-4, 2e-5)),
    )
    return basis_of(gear, draws=draws)


def bent(draws: int = 500, theory="ring") -> Basis:
    """Return draws of a gear that gets stiffer as it is deformed."""
    basis = known(draws, theory)
    slope = np.random.default_rng(1).normal(0.35, 0.05, draws)
    return replace(
        basis,
        problem=replace(basis.problem, effects=(ProgressiveStiffening,)),
        values={**basis.values, "progressive_stiffening.slope": slope},
    )
