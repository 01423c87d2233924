"""The force and stress that a gear exceeds rarely, differentiable in all its sizes."""

from collections.abc import Mapping
from dataclasses import replace
from math import ceil

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from hdcal.data.records import Array, Geometry
from hdcal.design.design_draws import Basis
from hdcal.design.next_gear import NextGear
from hdcal.design.sizes import SIZES
from hdcal.inference.problem import Problem
from hdcal.physics.profile import peak_stress
from hdcal.physics.theory import THEORIES, Scalar
from hdcal.prediction.forces import gear_force

# What a derivative may be taken by, beside the sizes.
_ALONE = {"deformation_mm", "modulus", "K"}


class Target(eqx.Module):
    """The next gear at the worst of some temperatures, as a function of its drawing.

    Attributes:
        problem: structure.
        values: draws by site: [draw, …].
        own: the tested gear's formula stiffness per modulus [mm].
        deviation: of each draw's gear, relative stiffness, shape (draw,).
        shifts: of its sizes [mm], by field of the geometry, shape (draw,).
        temperatures: [°C], shape (t,).
        limit: stress that must not be exceeded [MPa], shape (draw,); infinite where
            there is none.
        theory: which stiffness K multiplies.
        rank: place of the quantile among the sorted draws.
    """

    problem: Problem
    values: dict
    own: Float[Array, ""] | float
    deviation: Float[Array, " d"]
    shifts: dict
    temperatures: Float[Array, " t"]
    limit: Float[Array, " d"]
    theory: str = eqx.field(static=True)
    rank: int = eqx.field(static=True)

    @classmethod
    def of(
        cls,
        basis: Basis,
        gear: NextGear,
        temperatures: np.ndarray,
        probability: float,
        limit_stress: float | None = None,
    ) -> "Target":
        """Return the target of a basis.

        Args:
            basis: draws, of the material in use.
            gear: how the next one differs.
            temperatures: at all of which the limits hold [°C].
            probability: share of the draws that have to keep a limit.
            limit_stress: [MPa]; by default the yield strength, where one is known.
        """
        strength = basis.yield_strength
        if limit_stress is not None:
            strength = np.full(basis.size, limit_stress)
        return cls(
            problem=basis.problem,
            values={name: np.asarray(v) for name, v in basis.values.items()},
            own=float(THEORIES[basis.theory](basis.gear.geometry, 1.0)),
            deviation=gear.deviation,
            shifts={SIZES[name]: shift for name, shift in gear.shifts.items()},
            temperatures=temperatures,
            limit=np.full(basis.size, np.inf) if strength is None else strength,
            theory=basis.theory,
            # Every smaller draw keeps the limit too: never fewer than were asked for.
            rank=ceil(probability * basis.size - 1e-9) - 1,
        )

    def made(self, geometry: Geometry) -> Geometry:
        """Return the gears as made: the drawing and each draw's deviations from it."""
        moved = {name: getattr(geometry, name) + s for name, s in self.shifts.items()}
        return replace(geometry, **moved)

    def forces(
        self, geometry: Geometry, deformation: Scalar, modulus: Scalar, K: Scalar
    ) -> Float[Array, " d"]:
        """Return the largest force over the temperatures of each draw [N].

        Args:
            geometry: the drawing [mm].
            deformation: radial [mm].
            modulus: factor on Young's modulus [-].
            K: factor on the influence coefficient [-].
        """
        stiffness = THEORIES[self.theory](self.made(geometry), 1.0) / self.own
        factor = stiffness * (1.0 + self.deviation) * modulus * K
        at = jnp.broadcast_to(jnp.asarray(deformation), self.temperatures.shape)

        def of_draw(value, own):
            each = gear_force(self.problem, value, at, self.temperatures, factor=own)
            return jnp.max(each)

        count = self.deviation.shape
        return jax.vmap(of_draw)(self.values, jnp.broadcast_to(factor, count))

    def stresses(
        self, geometry: Geometry, deformation: Scalar, modulus: Scalar
    ) -> Float[Array, " d"] | float:
        """Return the largest hoop bending stress over the temperatures [MPa]."""
        rise = self.temperatures - self.problem.reading.reference_temperature
        warm = jnp.max(1.0 - self.values["alpha"][:, None] * rise, axis=1)
        own = self.values["E0"] * warm * modulus
        return peak_stress(self.made(geometry), own, deformation)

    def force(self, geometry: Geometry, place: Mapping[str, Scalar]) -> Scalar:
        """Return the force that is kept with the target's probability [N].

        Args:
            geometry: the tested gear [mm].
            place: sizes by edge name that replace its own, and deformation_mm, modulus
                and K.
        """
        sizes = {SIZES[n]: v for n, v in place.items() if n not in _ALONE}
        alone = place["deformation_mm"], place["modulus"], place["K"]
        return jnp.sort(self.forces(replace(geometry, **sizes), *alone))[self.rank]

    def utilisation(self, geometry: Geometry, place: Mapping[str, Scalar]) -> Scalar:
        """Return the share of the allowed stress that is kept with the probability."""
        sizes = {SIZES[n]: v for n, v in place.items() if n not in _ALONE}
        alone = place["deformation_mm"], place["modulus"]
        share = self.stresses(replace(geometry, **sizes), *alone) / self.limit
        return jnp.sort(share)[self.rank]
