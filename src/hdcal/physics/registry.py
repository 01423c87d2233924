"""The library of effects: a plain dict, extended from outside by dict union."""

from hdcal.physics.effect import Effect
from hdcal.physics.effects import (
    contact,
    loops,
    noise,
    scatter,
    sensor,
    stiffness,
    temperature,
    time,
)

EFFECTS: dict[str, type[Effect]] = {
    effect.name: effect
    for effect in (
        contact.SeatingSlack,
        contact.ContactBedding,
        sensor.RigCompliance,
        temperature.ThermalExpansion,
        sensor.DisplacementNonlinearity,
        sensor.ScrewError,
        contact.ContactOnset,
        stiffness.ProgressiveStiffening,
        stiffness.LargeDeflection,
        loops.PlasticYield,
        loops.CoulombFriction,
        loops.LoadFriction,
        stiffness.Ovality,
        temperature.ThermalStiffness,
        loops.Hysteresis,
        time.ViscousDamping,
        time.Relaxation,
        stiffness.StiffnessFatigue,
        scatter.SpecimenVariation,
        time.ChargeLeakage,
        time.AmplifierDrift,
        temperature.ThermalZeroDrift,
        sensor.ForceSaturation,
        scatter.RunOffset,
        noise.Quantisation,
        noise.HeteroscedasticNoise,
        noise.Outliers,
    )
}
