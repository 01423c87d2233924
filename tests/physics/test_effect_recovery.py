"""Every effect of typical size is found again in data that it made."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from effect_bench import BEYOND_RECORDS, noisy, typical
from jax.flatten_util import ravel_pytree
from scipy import optimize
from slices import slice_of

from hdcal import EFFECTS
from hdcal.inference.force_model.likelihood import log_probability
from hdcal.physics.chain import Base, predict_reading
from hdcal.physics.effect import parameters

# Sd of the loss of modulus that a material's prior allows [1/K].
ALPHA_SD = 0.4e-4
TESTABLE = sorted(n for n in EFFECTS if not EFFECTS[n].needs & BEYOND_RECORDS)
# Rounding seen as noise adds to the noise: readings show the sum of the two alone.
SIGMA_KNOWN = {"quantisation"}


# One of each stage; the others are thorough.
KINDS = ("coulomb_friction", "outliers", "relaxation", "seating_slack")


@pytest.mark.parametrize("name", slice_of(TESTABLE, KINDS))
def test_recovered_from_its_own_data(name, loading, base, reading):
    """Maximum likelihood finds a typical effect within four standard errors.

    The zero of the deformation is known here; it is the rest of the chain that
    has to be told from the effect. A change of stiffness with temperature is told
    from the modulus by the material alone, so there its alpha is believed.
    """
    believed = EFFECTS[name].family == "slope over temperature"
    unknown = [base.sigma] if name not in SIGMA_KNOWN else []
    core = (base.stiffness, base.alpha, base.force_offset)
    truth = (typical(name), *core, *unknown)
    scale, unravel = ravel_pytree(truth)

    def chain(point):
        effect, stiffness, alpha, offset, *noise = unravel(scale * point)
        zero, sigma = base.deformation_offset, *(noise or [base.sigma])
        return [effect], Base(stiffness, alpha, zero, offset, sigma)

    one = jnp.ones(len(scale))
    effects, made_by = chain(one)
    records = noisy(loading, made_by, reading, effects)

    def cost(point):
        effects, base = chain(point)
        mean, noise = predict_reading(base, effects, records, reading)
        rows = log_probability(records.force, mean, noise, 0.0, rounded=False)
        surprise = 0.5 * ((base.alpha - truth[2]) / ALPHA_SD) ** 2
        return -jnp.sum(rows) + (surprise if believed else 0.0)

    @jax.jit
    def expand(point):
        """Return value, slope and curvature, with one compilation for the three."""

        def twice(point):
            value, slope = jax.value_and_grad(cost)(point)
            return slope, (value, slope)

        curve, (value, slope) = jax.jacfwd(twice, has_aux=True)(point)
        return value, slope, curve

    def finite(part):
        """Return a part of the expansion; harmless where a parameter left its range."""

        def at(point):
            found = [np.asarray(each) for each in expand(point)]
            if all(np.isfinite(each).all() for each in found):
                return found[part]
            return (np.inf, np.zeros(len(point)), np.eye(len(point)))[part]

        return at

    count = len(parameters(EFFECTS[name]))
    start = np.where(np.arange(len(scale)) < count, 0.6, 0.9)
    height, slope, curve = (finite(part) for part in range(3))
    found = optimize.minimize(
        height,
        start,
        jac=slope,
        hess=curve,
        method="trust-exact",
        options={"gtol": 1e-6},
    )
    hessian = curve(found.x)
    curvatures = np.linalg.eigvalsh(hessian)
    assert curvatures[0] > 1e-10 * curvatures[-1]
    covariance = np.linalg.inv(hessian)
    error = np.sqrt(np.diag(covariance))
    # The search has ended at a maximum: what is left of the slope moves nothing.
    assert np.max(np.abs(covariance @ slope(found.x)) / error) < 1e-3
    # A part of the noise enters by its square, so its sign is nobody's.
    place = np.abs(found.x) if EFFECTS[name].stage == "noise" else found.x
    assert np.max(np.abs(place - 1.0) / error) < 4.0
    # And the data say so: at least one parameter of the effect is clearly not absent.
    assert np.min(error[:count]) < 0.3
