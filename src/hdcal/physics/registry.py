"""The library of effects: a plain dict, extended from outside by dict union."""

from hdcal.physics.effect import Effect
from hdcal.physics.effects.amplifier_drift import AmplifierDrift
from hdcal.physics.effects.charge_leakage import ChargeLeakage
from hdcal.physics.effects.contact_bedding import ContactBedding
from hdcal.physics.effects.contact_onset import ContactOnset
from hdcal.physics.effects.coulomb_friction import CoulombFriction
from hdcal.physics.effects.displacement_nonlinearity import DisplacementNonlinearity
from hdcal.physics.effects.force_saturation import ForceSaturation
from hdcal.physics.effects.heteroscedastic_noise import HeteroscedasticNoise
from hdcal.physics.effects.hysteresis import Hysteresis
from hdcal.physics.effects.large_deflection import LargeDeflection
from hdcal.physics.effects.load_friction import LoadFriction
from hdcal.physics.effects.outliers import Outliers
from hdcal.physics.effects.ovality import Ovality
from hdcal.physics.effects.plastic_yield import PlasticYield
from hdcal.physics.effects.progressive_stiffening import ProgressiveStiffening
from hdcal.physics.effects.quantisation import Quantisation
from hdcal.physics.effects.relaxation import Relaxation
from hdcal.physics.effects.rig_compliance import RigCompliance
from hdcal.physics.effects.run_offset import RunOffset
from hdcal.physics.effects.screw_error import ScrewError
from hdcal.physics.effects.seating_slack import SeatingSlack
from hdcal.physics.effects.specimen_variation import SpecimenVariation
from hdcal.physics.effects.stiffness_fatigue import StiffnessFatigue
from hdcal.physics.effects.thermal_expansion import ThermalExpansion
from hdcal.physics.effects.thermal_stiffness import ThermalStiffness
from hdcal.physics.effects.thermal_zero_drift import ThermalZeroDrift
from hdcal.physics.effects.viscous_damping import ViscousDamping

EFFECTS: dict[str, type[Effect]] = {
    effect.name: effect
    for effect in (
        SeatingSlack,
        ContactBedding,
        RigCompliance,
        ThermalExpansion,
        DisplacementNonlinearity,
        ScrewError,
        ContactOnset,
        ProgressiveStiffening,
        LargeDeflection,
        PlasticYield,
        CoulombFriction,
        LoadFriction,
        Ovality,
        ThermalStiffness,
        Hysteresis,
        ViscousDamping,
        Relaxation,
        StiffnessFatigue,
        SpecimenVariation,
        ChargeLeakage,
        AmplifierDrift,
        ThermalZeroDrift,
        ForceSaturation,
        RunOffset,
        Quantisation,
        HeteroscedasticNoise,
        Outliers,
    )
}
