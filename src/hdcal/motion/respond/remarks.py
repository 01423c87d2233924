"""What a response rests on: data, priors or what was given; and its remarks."""

import numpy as np

from hdcal.inference.dynamic_posterior import DynamicPosterior
from hdcal.inference.posterior import Posterior
from hdcal.physics.dynamics import FRICTION_SPEED
from hdcal.prediction.engine.conditions import NEAR_MM, temperature_is_tested


def drivers(posterior: Posterior, mass, damping) -> dict[str, str]:
    """Say of each quantity whether data, a prior or the user decided it."""
    of = {name: found.driven_by for name, found in posterior.diagnoses.items()}
    stiffness = of.get("K", "prior")
    if isinstance(posterior, DynamicPosterior):
        m, z = of.get("mass", "prior"), of.get("damping_ratio", "prior")
        both = "data" if (m, z) == ("data", "data") else "prior"
        frequency, c = m, both
    else:
        m = "prior" if mass is None else "given"
        c = "prior" if damping is None else "given"
        # With the mass given, what is left to know of the frequency is the stiffness.
        frequency = "prior" if mass is None else stiffness
        z = "prior" if "prior" in (m, c) else stiffness
        both = z
    return {
        "mass_kg": m,
        "damping_N_s_per_mm": c,
        "damping_ratio": z,
        "stiffness_N_per_mm": stiffness,
        "natural_frequency_Hz": frequency,
        "damped_frequency_Hz": "prior" if "prior" in (frequency, z) else "data",
        "peak_mm": both,
    }


def tested_rows(posterior: Posterior, temperature: float, lo, hi) -> np.ndarray:
    """Return where a band lies within what was calibrated.

    Args:
        posterior: with its records.
        temperature: of the gear [°C].
        lo: lower end of the band of the deformation from the unloaded gear [mm].
        hi: its upper end.
    """
    records = posterior.case.records
    zero = float(np.median(posterior.draws["deformation_offset"]))
    low = min(0.0, float(np.min(records.deformation)) - zero)
    high = float(np.max(records.deformation)) - zero
    inside = (lo >= low - NEAR_MM) & (hi <= high + NEAR_MM)
    return inside & temperature_is_tested(records, temperature)


def remarks(
    posterior: Posterior, times, estimates: dict, kept, left, tested
) -> tuple[str, ...]:
    """Return what the reader must know, in sentences.

    Args:
        posterior: what the answer rests on.
        times: of the answer [s].
        estimates: of the answer, with their drivers.
        kept: effects taken along.
        left: effects left out.
        tested: from `tested_rows`.
    """
    said = _unseen(posterior, estimates)
    outside = np.count_nonzero(~tested)
    if outside:
        said.append(
            f"{outside} of {len(tested)} times lie outside the deformations or the "
            "temperature that were calibrated: extrapolated."
        )
    if left:
        listed = ", ".join(effect.name for effect in left)
        said.append(
            f"Left out, because they remember what came before or belong to gauges and "
            f"sensors: {listed}."
        )
    if any(effect.name == "coulomb_friction" for effect in kept):
        said.append(
            f"Dry friction turns its sign over a speed of {FRICTION_SPEED:g} mm/s: a "
            "gear that sticks creeps instead."
        )
    if kept:
        said.append("Frequency, damping and stiffness are those without the effects.")
    step = float(np.median(np.diff(times)))
    highest = estimates["natural_frequency_Hz"]["hi"]
    if 2.0 * highest * step > 1.0:
        said.append(
            f"A natural frequency of up to {highest:.4g} Hz swings faster than the "
            f"{1.0 / step:.4g} times per second show: use more --points or a shorter "
            "--duration."
        )
    if len(posterior.case.specimen_labels) > 1:
        said.append("The stiffness is the mean of the tested gears, not of a new one.")
    return tuple(said)


def _unseen(posterior: Posterior, estimates: dict) -> list[str]:
    """Say what a gear at rest tells nothing of."""
    if isinstance(posterior, DynamicPosterior):
        return []
    both = {"mass": "mass_kg", "damping": "damping_N_s_per_mm"}
    unseen = [n for n, e in both.items() if estimates[e]["driven_by"] == "prior"]
    if not unseen:
        return []
    listed = " and ".join(unseen)
    return [
        f"The gear was calibrated at rest, which says nothing of its {listed}: "
        "there the prior is the answer. Measure a vibration and use hdcal "
        "calibrate --dynamic, or weigh what moves and say --mass-kg."
    ]
