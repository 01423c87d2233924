"""The linear budget of few rows holds what it promises, over many simulated rigs."""

import numpy as np
import pytest
from posteriors import regressed
from test_margin_budget import forces_of

from hdcal.prediction.budget.linear import coverage_factor
from hdcal.prediction.margin.budget import averaged_budget

ROWS, AT, STIFFNESS, ZERO, NOISE = 6, 0.4, 205.0, -1.0, 0.6


def covered(rigs: int, seed: int) -> tuple[float, float]:
    """Return how often y ± U holds the next reading, and how often y ± 1.96 u does."""
    rng, held = np.random.default_rng(seed), []
    deformation = np.linspace(0.05, 0.54, ROWS)
    for _ in range(rigs):
        true = STIFFNESS * deformation + ZERO
        posterior = regressed(deformation, true + rng.normal(0.0, NOISE, ROWS), rng)
        found = averaged_budget(forces_of(posterior, at=AT))
        ahead = STIFFNESS * AT + ZERO + rng.normal(0.0, NOISE)
        off, u = abs(ahead - found.estimate), found.variance**0.5
        held.append((off <= coverage_factor(found.dof) * u, off <= 1.96 * u))
    mine, normal = np.mean(held, axis=0)
    return float(mine), float(normal)


def check(share: float, rigs: int) -> None:
    """Require 95 %, within three standard errors."""
    assert abs(share - 0.95) < 3.0 * np.sqrt(0.95 * 0.05 / rigs)


def test_the_stated_coverage_is_kept():
    share, _ = covered(80, seed=21)
    check(share, 80)


@pytest.mark.slow
def test_the_stated_coverage_is_kept_on_many_rigs_and_a_normal_factor_keeps_it_not():
    """The wrong twin: four degrees of freedom taken for infinitely many."""
    share, normal = covered(1500, seed=22)
    check(share, 1500)
    with pytest.raises(AssertionError):
        check(normal, 1500)
