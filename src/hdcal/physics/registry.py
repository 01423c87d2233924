"""The library of effects: a plain dict, extended from outside by dict union."""

from hdcal.physics.effect import Effect
from hdcal.physics.effects.charge_leakage import ChargeLeakage
from hdcal.physics.effects.coulomb_friction import CoulombFriction
from hdcal.physics.effects.outliers import Outliers
from hdcal.physics.effects.progressive_stiffening import ProgressiveStiffening
from hdcal.physics.effects.seating_slack import SeatingSlack
from hdcal.physics.effects.thermal_zero_drift import ThermalZeroDrift

EFFECTS: dict[str, type[Effect]] = {
    effect.name: effect
    for effect in (
        SeatingSlack,
        ProgressiveStiffening,
        CoulombFriction,
        ChargeLeakage,
        ThermalZeroDrift,
        Outliers,
    )
}
