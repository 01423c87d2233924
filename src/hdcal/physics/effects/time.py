"""Forces and readings that depend on speed or time."""

from hdcal.physics.effect import Effect, PerRow, Rows, parameter
from hdcal.physics.history import fading
from hdcal.physics.theory import Scalar


class ViscousDamping(
    Effect, stage="force", family="rate or time", needs=("rates",), instantaneous=True
):
    """F → F + c dω/dt, with the rate as read.

    Drag in proportion to the speed of loading.
    """

    coefficient: Scalar = parameter(
        "N*s/mm", "drag per rate of deformation", typical=6.0, null=0.0
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        return signal + self.coefficient * rows.records.rate


class Relaxation(
    Effect, stage="force", family="rate or time", needs=("time", "holds or rates")
):
    """One Prony arm: F → F − s ∫ (1 − e^(−(t−t')/τ)) d(k ω)(t').

    The load of the gear decays while its deformation is held. k ω is taken as linear in
    time between rows, for which the step is exact. Every run starts relaxed at the
    reset, as a gear that has rested for many τ.

    Source: Ferry, Viscoelastic Properties of Polymers (standard linear solid).
    """

    share: Scalar = parameter(
        "1", "share of the load that relaxes in the end", typical=0.03, null=0.0
    )
    time_constant: Scalar = parameter(
        "s", "time in which that share falls to 37 %", typical=30.0
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        load, records = rows.stiffness * rows.deformation, rows.records
        left = fading(load, records.time, records.run, 1.0 / self.time_constant)
        return signal - self.share * (load - left)


class ChargeLeakage(Effect, stage="sensor", family="rate or time", needs=("time",)):
    """dF_m = dF − λ F_m dt, reset at the start of each run; λ = 1/τ.

    Charge leaks from the amplifier of a piezoelectric sensor: readings decay to zero.
    The force is taken as linear in time between rows, for which the step is exact:
    F_m ← F_m e^(−λΔt) + ΔF (1 − e^(−λΔt))/(λΔt). Before its first row a run has
    climbed from zero since the reset at t = 0.

    Source: charge-amplifier handbooks (discharge time constant τ = R C).
    """

    rate: Scalar = parameter(
        "1/s", "leak rate, one over the time constant", typical=1e-3, null=0.0
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        records = rows.records
        return fading(signal, records.time, records.run, self.rate)


class AmplifierDrift(Effect, stage="sensor", family="rate or time", needs=("time",)):
    """F → F + r t, with t since the reset of the run; either sign.

    The zero of the amplifier drifts after its reset.

    Source: Gautschi, Piezoelectric Sensorics (drift of charge amplifiers).
    """

    rate: Scalar = parameter(
        "N/s", "shift of the zero per second", typical=0.02, null=0.0
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        return signal + self.rate * rows.records.time
