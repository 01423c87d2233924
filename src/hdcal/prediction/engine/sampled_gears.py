"""One gear beside each draw: its forces together, as a function of the drawing.

For questions about the same gear under several conditions at once, which the mixture
of a whole population under one condition cannot answer.
"""

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.case import Theory
from hdcal.data.records import Array, Geometry
from hdcal.inference.problem import Problem
from hdcal.physics.theory import Scalar
from hdcal.prediction.engine.gear_forces import gear_forces
from hdcal.prediction.engine.sizes import shifted, stiffness_ratio
from hdcal.prediction.engine.untested import Untested


class SampledGears(eqx.Module):
    """A gear for each draw, none of them tested; differentiable in the drawing.

    Attributes:
        problem: structure.
        values: draws by site: [draw, …].
        tested: sizes of the gear that the draws are of [mm].
        deviation: of each gear's stiffness from the tested mean, relative, (draw,).
        shifts: of its sizes from the drawing [mm], by field, (draw,).
        untested: what the draws leave open, or None where no gear was tested.
        theory: which stiffness K multiplies.
    """

    problem: Problem
    values: dict
    tested: Geometry
    deviation: Float[Array, " draw"]
    shifts: Mapping[str, Float[Array, " draw"]]
    untested: Untested | None
    theory: Theory = eqx.field(static=True)

    def made(self, drawing: Geometry) -> Geometry:
        """Return the gears as made: the drawing and each one's deviations from it."""
        return shifted(drawing, self.shifts)

    def forces(
        self,
        drawing: Geometry,
        deformation: Float[Array, " n"],
        temperature: Float[Array, " n"],
        modulus: Scalar = 1.0,
        K: Scalar = 1.0,
    ) -> Float[Array, "n draw"]:
        """Return the force on each gear alone [N].

        Args:
            drawing: sizes [mm].
            deformation: radial [mm].
            temperature: of the gear [°C].
            modulus: factor on Young's modulus [-].
            K: factor on the influence coefficient [-].
        """
        ratio = stiffness_ratio(self.made(drawing), self.tested, self.theory)
        factor = ratio * (1.0 + self.deviation) * modulus * K
        factor = jnp.asarray(factor)[:, None]
        where = deformation, temperature, factor, self.untested
        return gear_forces(self.problem, self.values, *where)
