"""Elasticities are slopes of the quantile of the force."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hdcal.design.inverse_design.candidate import elasticities


class Springs(eqx.Module):
    """Gears k x + b of which k scatters little; stands for a gear with a limit."""

    k: jax.Array
    b: jax.Array
    rank: int = eqx.field(static=True)
    deformation: float = 10.0

    @property
    def drawing(self):
        """Return sizes that mean nothing here."""
        return self

    wall_thickness = radius = length = 1.0

    def forces(self, place):
        """Return the force of each draw."""
        return self.k * place["deformation_mm"] + self.b


@pytest.mark.parametrize(("draws", "share"), [(4000, 0.5), (4000, 0.99), (400, 0.95)])
def test_the_slope_is_that_of_the_quantile(draws, share):
    rng = np.random.default_rng(1)
    many = np.stack([1.0 + 0.02 * rng.normal(size=200_000), rng.normal(size=200_000)])
    rank = int(share * draws)
    found = [
        elasticities(Springs(*map(jnp.asarray, each), rank), {})["deformation_mm"]
        for each in np.split(many, 200_000 // draws, axis=1)
    ]
    k, b = many
    ends = [np.quantile(k * x + b, share) for x in (9.9, 10.1)]
    true = (ends[1] - ends[0]) / 0.2 * 10.0 / np.quantile(k * 10.0 + b, share)
    assert np.mean(found) == pytest.approx(true, abs=0.01)
    # The slope of a single draw would scatter as b does, given the force.
    assert np.std(found) < 0.05
