"""Add an effect to the library and let a diagnosis name it."""

from dataclasses import replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np

import hdcal

FOLDER = Path(__file__).parents[1] / "datasets" / "thermal-demo"


class WarmFriction(
    hdcal.Effect,
    stage="force",
    groups=("loop",),
    needs=("temperature", "unloading"),
    symmetry="none",
):
    """F → F + h s (T − T_ref): friction that grows with temperature.

    Source: made up for this example.
    """

    slope: float = hdcal.parameter("N/K", "friction per kelvin", typical=0.02, null=0.0)

    def apply(self, signal, rows):
        """Return the force with the friction added."""
        return signal + self.slope * rows.temperature_rise * rows.records.sense


def main() -> None:
    case = hdcal.read_case(FOLDER)
    prior = hdcal.Prior("half_normal", (0.03,), "N/K", "made up for this example")
    gear = replace(case.gear, effect_priors={"warm_friction.slope": prior})
    records = case.records
    rise = np.asarray(records.temperature) - gear.reference_temperature
    # Simulated readings on the rows of the bundled test, with friction when warm.
    stiffness = 200.0 * (1.0 - 3e-4 * rise)
    noise = np.random.default_rng(3).normal(0.0, 0.4, len(rise))
    force = stiffness * np.asarray(records.deformation) + noise
    force += 0.03 * rise * np.asarray(records.sense)
    case = replace(case, gear=gear, records=replace(records, force=jnp.asarray(force)))

    library = hdcal.EFFECTS | {WarmFriction.name: WarmFriction}
    found = hdcal.diagnose(case, library=library, quick=True)
    print(found.headline)
    print(found.to_frame())
    assert found.which.inclusion["warm_friction"] > 0.9

    # A prior for an effect that is not in the library would be refused.
    without = hdcal.diagnose(
        replace(case, gear=replace(gear, effect_priors={})), quick=True
    )
    assert "warm_friction" not in without.which.inclusion
    assert without.which.outside.probability > 0.5
    print("without it in the library something outside acts")


if __name__ == "__main__":
    main()
