"""The measurement chain: deformation → force → sensor → noise.

F = K k(E(T)) (ω − ω₀) + b,  E(T) = E₀ (1 − α (T − T_ref)),
with any set of effects on their stages; an effect never knows another.
"""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array, Geometry, Records
from hdcal.physics.effect import Effect, Noise, Rows, Stage
from hdcal.physics.theory import THEORIES

Value = Float[Array, ""] | Float[Array, " n"] | float


class Base(eqx.Module):
    """The force model without effects; entries may differ from row to row.

    K·k_theory(E₀) per radial displacement at T_ref [N/mm], α [1/K], ω₀ in the
    deformation as read [mm], b [N] and the noise sd of a reading [N].
    """

    stiffness: Value
    alpha: Value
    deformation_offset: Value
    force_offset: Value
    sigma: Value


class Reading(eqx.Module):
    """How the rig reads: fixed by the gear file, never inferred.

    Radial displacement per displacement read, 1 or ½ [-], and T_ref [°C].
    """

    radial_per_read: float
    reference_temperature: float


def _apply(stage: Stage, effects: Sequence[Effect], signal, rows: Rows):
    for effect in effects:
        if effect.stage == stage:
            signal = effect.apply(signal, rows)
    return signal


def predict_reading(
    base: Base, effects: Sequence[Effect], records: Records, reading: Reading
) -> tuple[Float[Array, " n"], Noise]:
    """Compute the mean reading [N] and the noise of each row, before any rounding.

    Records are in the order they were taken; effects may be any set.
    """
    rise = records.temperature - reading.reference_temperature
    stiffness = base.stiffness * (1.0 - base.alpha * rise)
    radial = (records.deformation - base.deformation_offset) * reading.radial_per_read
    rows = Rows(records, rise, stiffness, radial)

    seen = _apply("deformation", effects, radial, rows)
    rows = Rows(records, rise, stiffness, seen)
    force = _apply("force", effects, stiffness * seen, rows)
    mean = _apply("sensor", effects, force, rows) + base.force_offset

    sd = jnp.sqrt(base.sigma**2 + records.force_sd**2)
    noise = Noise(jnp.zeros(1), jnp.broadcast_to(sd, (1, *mean.shape)))
    return mean, _apply("noise", effects, noise, rows)


def linear_columns(records: Records, reading: Reading) -> Float[Array, "n 4"]:
    """Return the columns in which the chain without effects is linear: ω, ωΔT, 1, ΔT.

    mean = s ρ·ω − s α ρ·ω ΔT + (b − s ρ ω₀) + s α ρ ω₀·ΔT, with ρ the radial
    displacement per displacement read and s the stiffness.
    """
    rise = records.temperature - reading.reference_temperature
    one = jnp.ones_like(rise)
    return jnp.stack(
        [records.deformation, records.deformation * rise, one, rise], axis=1
    )


def linear_coefficients(base: Base, reading: Reading) -> Float[Array, "*g 4"]:
    """Return the coefficients that belong to `linear_columns`."""
    slope = base.stiffness * reading.radial_per_read
    zero = base.deformation_offset
    parts = (
        slope,
        -slope * base.alpha,
        base.force_offset - slope * zero,
        slope * base.alpha * zero,
    )
    return jnp.stack(jnp.broadcast_arrays(*map(jnp.asarray, parts)), axis=-1)


def force(
    geometry: Geometry,
    modulus: Value,
    influence: Value,
    deformation: Value,
    *,
    theory: str = "ring",
    alpha: Value = 0.0,
    temperature_rise: Value = 0.0,
    deformation_offset: Value = 0.0,
    force_offset: Value = 0.0,
) -> Float[Array, "..."]:
    """Compute F = K k(E₀ (1 − α ΔT)) (ω − ω₀) + b [N], broadcast and differentiable.

    Args:
        geometry: sizes [mm].
        modulus: Young's modulus E₀ at the reference temperature [MPa].
        influence: K under `theory` [-].
        deformation: radial ω [mm].
        theory: a name of `THEORIES`.
        alpha: relative loss of modulus per kelvin [1/K].
        temperature_rise: ΔT = T − T_ref [K].
        deformation_offset: ω₀ [mm].
        force_offset: b [N].
    """
    deformation = jnp.asarray(deformation, dtype=float)
    warm = modulus * (1.0 - alpha * temperature_rise)
    stiffness = influence * THEORIES[theory](geometry, warm)
    return stiffness * (deformation - deformation_offset) + force_offset
