"""Gains and zeros of the gauges that a certificate states, between true and as read.

    F_read = (1 + g) F + b,   ω_read = (1 + h) ω,   T_read = T + θ,

with ω₀ in the reading of the deformation. The likelihood, the loss of modulus with
temperature α, effects and leftover are in terms of what was read; E₀, K and the
stiffness are true. What no certificate states is left out.
"""

from collections.abc import Mapping
from typing import Any

Values = Mapping[str, Any]


def with_gains(values: Values, ratio: Any) -> Any:
    """Return force per deformation as read from the true one."""
    if "force_gain" in values:
        ratio = ratio * (1.0 + values["force_gain"])
    if "deformation_gain" in values:
        ratio = ratio / (1.0 + values["deformation_gain"])
    return ratio


def where_read(values: Values, stiffness: Any) -> Any:
    """Return the stiffness where T_ref is read from that at a true T_ref."""
    if "temperature_offset" in values:
        stiffness = stiffness / (1.0 - values["alpha"] * values["temperature_offset"])
    return stiffness


def as_read(values: Values, stiffness: Any) -> Any:
    """Return the stiffness as read, where T_ref is read, from the true one at T_ref."""
    return with_gains(values, where_read(values, stiffness))


def shown(values: Values, deformation: Any, temperature: Any) -> tuple[Any, Any]:
    """Return what the gauges show at a true deformation and temperature."""
    if "deformation_gain" in values:
        deformation = deformation * (1.0 + values["deformation_gain"])
    if "temperature_offset" in values:
        temperature = temperature + values["temperature_offset"]
    return deformation, temperature


def acting(values: Values, force: Any) -> Any:
    """Return the force that acts from one that is read, zero taken off."""
    return force / (1.0 + values["force_gain"]) if "force_gain" in values else force
