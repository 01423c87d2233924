"""Quantiles of force and stress of a gear, differentiable in all its sizes.

Both are sizes, along the sense of loading.
"""

from collections.abc import Mapping
from dataclasses import replace
from math import ceil

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from hdcal.data.records import Array, Geometry
from hdcal.design.design_draws import DesignDraws
from hdcal.design.inverse_design.limit import LimitAsked
from hdcal.design.next_gear import NextGear
from hdcal.design.sizes import geometry_with
from hdcal.physics.profile import peak_stress
from hdcal.physics.theory import Scalar
from hdcal.prediction.engine.sampled_gears import SampledGears
from hdcal.prediction.engine.sizes import SIZES


class LimitedGear(eqx.Module):
    """The next gear at the worst of some temperatures, and its limits.

    Its methods take a place: the differences from the tested gear, by name. These may
    be sizes [mm], deformation_mm, and factors on modulus and K.

    Attributes:
        gears: one for each draw.
        drawing: the tested gear's sizes, of the material in use [mm].
        deformation: radial, with its sign [mm].
        sense: of loading.
        temperatures: [°C], shape (t,).
        limit_force: that must not be exceeded [N].
        limit_stress: that must not be exceeded [MPa], shape (draw,); infinite where
            there is none.
        rank: place of the quantile among the sorted draws.
    """

    gears: SampledGears
    drawing: Geometry
    deformation: Scalar
    sense: Scalar
    temperatures: Float[Array, " t"]
    limit_force: float
    limit_stress: Float[Array, " draw"]
    rank: int = eqx.field(static=True)

    @classmethod
    def of(cls, draws: DesignDraws, gear: NextGear, asked: LimitAsked) -> "LimitedGear":
        """Return the gear of the material of these draws."""
        strength = draws.yield_strength
        if asked.limit_stress_MPa is not None:
            strength = np.full(draws.size, asked.limit_stress_MPa)
        elif strength is None:
            strength = np.full(draws.size, np.inf)
        return cls(
            gears=replace(gear.gears, values=dict(draws.values)),
            drawing=draws.drawing,
            deformation=asked.deformation_mm,
            sense=float(asked.sense),
            temperatures=np.asarray(asked.temperature_C),
            limit_force=asked.limit_force_N,
            limit_stress=strength,
            # Every smaller draw keeps the limit too: at least as many as required.
            rank=ceil(asked.probability * draws.size - 1e-9) - 1,
        )

    def drawn(self, place: Mapping[str, Scalar]) -> Geometry:
        """Return the drawing with the sizes of a place."""
        sizes = {name: value for name, value in place.items() if name in SIZES}
        return geometry_with(self.drawing, sizes)

    def forces(self, place: Mapping[str, Scalar]) -> Float[Array, " draw"]:
        """Return the largest force over the temperatures of each draw [N].

        It is along the sense of loading.
        """
        at = jnp.asarray(place.get("deformation_mm", self.deformation))
        along = jnp.broadcast_to(at, self.temperatures.shape)
        factors = place.get("modulus", 1.0), place.get("K", 1.0)
        where = self.drawn(place), along, self.temperatures
        each = self.sense * self.gears.forces(*where, *factors)
        # The derivative of a maximum compares values, which a compiler may compute
        # twice with another rounding; that of a choice does not.
        worst = jnp.argmax(each, axis=0)
        return jnp.take_along_axis(each, worst[None], axis=0)[0]

    def stresses(self, place: Mapping[str, Scalar]) -> Float[Array, " draw"]:
        """Return the largest hoop bending stress over the temperatures [MPa]."""
        values = self.gears.values
        rise = self.temperatures - self.gears.problem.reading.reference_temperature
        warm = jnp.max(1.0 - values["alpha"][:, None] * rise, axis=1)
        modulus = values["E0"] * warm * place.get("modulus", 1.0)
        at = place.get("deformation_mm", self.deformation)
        made = self.gears.made(self.drawn(place))
        return jnp.asarray(peak_stress(made, modulus, self.sense * at))

    def force(self, place: Mapping[str, Scalar]) -> Scalar:
        """Return the force that is not exceeded with the required probability [N]."""
        return jnp.sort(self.forces(place))[self.rank]

    def utilisation(self, place: Mapping[str, Scalar]) -> Scalar:
        """Return the share of the allowed stress that is not exceeded likewise."""
        return jnp.sort(self.stresses(place) / self.limit_stress)[self.rank]
