"""The force of one future member as a function of the inputs of its budget."""

from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from hdcal.data.case import Theory
from hdcal.data.records import Array, Geometry
from hdcal.inference.problem import Problem
from hdcal.inference.values import Values
from hdcal.prediction.engine.conditions import Conditions
from hdcal.prediction.engine.population import Whose
from hdcal.prediction.engine.population_force import member_force
from hdcal.prediction.engine.sizes import shifted, stiffness_ratio

# The rig's drifts with temperature, and where the untested conditions hold them; what
# else simply adds to the force [N].
DRIFTS = {"zero_drift": "zero", "frame": "frame"}
_ADDED = ("noise", "resolution", "mounting", "leftover")


class ForceModel(eqx.Module):
    """The force as a function of the budget's inputs, deviations from their estimates.

    Attributes:
        problem: structure.
        values: means of the draws by site.
        whose: force it is.
        conditions: under which.
        nominal: sizes of the gear.
        depend: how the sites of a draw depend on the independent inputs, (m, m).
        sites: of a draw in their order.
        names: of the inputs after those.
        theory: of the stiffness.
    """

    problem: Problem
    values: Values
    whose: Whose
    conditions: Conditions
    nominal: Geometry
    depend: Float[Array, "m m"]
    sites: tuple[str, ...] = eqx.field(static=True)
    names: tuple[str, ...] = eqx.field(static=True)
    theory: Theory = eqx.field(static=True)

    def __call__(self, inputs: Float[Array, " n"]) -> Float[Array, ""]:
        """Return the force of one member [N]."""
        count = len(self.depend)
        more = dict(zip(self.names, inputs[count:], strict=True))
        value = self._value(self.depend @ inputs[:count])
        untested, there = self.conditions.untested, self.conditions
        for name, field in DRIFTS.items():
            mean, _ = getattr(untested, field)
            moved = (mean + more.get(name, 0.0), 0.0)
            untested = replace(untested, **{field: moved})
        there = replace(there, untested=untested)
        shifts = {n: by for n, by in more.items() if hasattr(self.nominal, n)}
        made = shifted(self.nominal, shifts)
        factor = stiffness_ratio(made, self.nominal, self.theory)
        factor = factor * (1.0 + more.get("gear", 0.0))
        quantity = self.whose.quantity
        force, _ = member_force(self.problem, value, quantity, there, factor)
        at, movement = (
            jnp.reshape(jnp.asarray(x, float), 1)
            for x in (there.deformation, there.movement)
        )
        bends = untested.bends(value)
        _, fitted = bends.leftover(self.problem, value, at, there.loading, movement)
        return force + fitted[0] + sum(more.get(name, 0.0) for name in _ADDED)

    def _value(self, moved) -> dict:
        """Return a draw whose sites have moved from the means."""
        value, start = dict(self.values), 0
        for site in self.sites:
            size = np.size(value[site])
            by = moved[start : start + size].reshape(np.shape(value[site]))
            value[site], start = value[site] + by, start + size
        # Of K and E₀ only the product matters: E₀ stays, K carries the stiffness.
        rate = value["E0"] * self.problem.unit_stiffness
        value["K"] = value["stiffness"] / (rate * self.problem.reading.radial_per_read)
        return value
