"""Mean and noise of each row, from the parameters of one draw.

Gains and zeros of the gauges that a certificate states are between true and as read:

    F_read = (1 + g) F + b,   ω_read = (1 + h) ω,   T_read = T + θ,

with ω₀ in the reading of the deformation. The likelihood, the loss of modulus with
temperature α, effects and discrepancy are in terms of what was read; E₀, K and the
stiffness are true. What no certificate states is left out.
"""

from typing import TYPE_CHECKING, Any

import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array, Records
from hdcal.inference.sampled_problem import Values
from hdcal.physics.chain import Base, predict_reading
from hdcal.physics.effect import Effect, Noise, parameters

if TYPE_CHECKING:
    from hdcal.inference.force_model.problem import Problem

# Site of each kind of parameter with one value per run, specimen or function of the
# discrepancy, and site of the sd between runs and between specimens.
MEMBERS = {
    "run": "run_offset",
    "specimen": "specimen_deviation",
    "discrepancy": "gap_weights",
}
MEMBER_SD = {"run": "run_offset_sd", "specimen": "specimen_sd"}
# Smallest noise sd, in rounding steps, that rounded readings can distinguish from zero.
# Noise of twice this size is increased by 5e-4 (relative).
LEAST_NOISE, _SHARPNESS = 0.1, 8.0


def apply_gains(values: Values, ratio: Any) -> Any:
    """Return force per deformation as read from the true one."""
    gain = 1.0 + values.get("force_gain", 0.0)
    return ratio * gain / (1.0 + values.get("deformation_gain", 0.0))


def stiffness_at_read_reference(values: Values, stiffness: Any) -> Any:
    """Return the true stiffness where T_ref is read, from that at the true T_ref."""
    offset = values.get("temperature_offset", 0.0)
    return stiffness / (1.0 - values["alpha"] * offset)


def stiffness_as_read(values: Values, stiffness: Any) -> Any:
    """Return the stiffness as read, where T_ref is read, from the true one at T_ref."""
    return apply_gains(values, stiffness_at_read_reference(values, stiffness))


def gauge_readings(
    values: Values, deformation: Any, temperature: Any
) -> tuple[Any, Any]:
    """Return what the gauges read at a true deformation and temperature."""
    deformation = deformation * (1.0 + values.get("deformation_gain", 0.0))
    return deformation, temperature + values.get("temperature_offset", 0.0)


def true_force(values: Values, force: Any) -> Any:
    """Return the true force from a reading without its zero."""
    return force / (1.0 + values.get("force_gain", 0.0))


def stiffness(problem: "Problem", values: Values) -> Float[Array, ""]:
    """Return K·k_theory at T_ref, per mm read without error [N/mm]."""
    radial = values["K"] * values["E0"] * problem.unit_stiffness
    return radial * problem.reading.radial_per_read


def member_base(problem: "Problem", values: Values, run=None, specimen=None) -> Base:
    """Return the base parameters of runs and specimens by their indices, as read.

    None stands for the mean of the tested ones. Deviations that are not among the
    values (integrated out) count as zero.
    """
    scale, offset = values["K"] * values["E0"] * problem.unit_stiffness, 0.0
    scale = stiffness_as_read(values, scale)
    if specimen is not None and "specimen_deviation" in values:
        scale = scale * (1.0 + values["specimen_deviation"][specimen])
    if run is not None and "run_offset" in values:
        offset = values["run_offset"][run]
    return Base(
        stiffness=scale,
        alpha=values["alpha"],
        deformation_offset=values["deformation_offset"],
        force_offset=values["force_offset"] + offset,
        sigma=values["sigma"],
    )


def build_effects(problem: "Problem", values: Values) -> tuple[Effect, ...]:
    """Return the effects of the problem with the parameters of one draw."""
    return tuple(
        effect(**{name: values[f"{effect.name}.{name}"] for name in parameters(effect)})
        for effect in problem.effects
    )


def predict_rows(
    problem: "Problem", values: Values, records: Records, columns
) -> tuple[Float[Array, " n"], Noise]:
    """Return mean reading [N] and noise of rows of the tested runs and specimens."""
    base = member_base(problem, values, records.run, records.specimen)
    mean, noise = predict_reading(
        base, build_effects(problem, values), records, problem.reading
    )
    if "gap_weights" in values:
        mean = mean + columns @ values["gap_weights"]
    return mean, noise


def rounding_variance(step: Any) -> Any:
    """Return the variance of rounding to a step, after Sheppard."""
    return step**2 / 12.0


def with_rounding(noise: Noise, step, *, rounded: bool = False) -> Noise:
    """Add Sheppard's variance of the rounding to the noise.

    Where rounding has its exact likelihood, the noise is at least `LEAST_NOISE` steps:
    without noise the likelihood is a step function, which a gradient sampler cannot
    cross. The maximum is smooth, and leaves larger noise unchanged.
    """
    if not rounded:
        sd = jnp.sqrt(noise.sd**2 + rounding_variance(step))
        return Noise(noise.log_weight, sd)
    logs = jnp.log(noise.sd), jnp.log(LEAST_NOISE * step)
    power = jnp.logaddexp(*(_SHARPNESS * log for log in logs))
    return Noise(noise.log_weight, jnp.exp(power / _SHARPNESS))
