"""What a response rests on: data, priors or what was given; and where it was tested."""

import numpy as np

from hdcal.inference.posterior import Posterior
from hdcal.motion.dynamic_posterior import DynamicPosterior
from hdcal.prediction.engine.conditions import NEAR_MM, temperature_is_tested
from hdcal.prediction.engine.pooled import Pooled


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


def tested_rows(pooled: Pooled, temperature: float, lo, hi) -> np.ndarray:
    """Return where a band lies within what was calibrated.

    Args:
        pooled: draws, with the records.
        temperature: of the gear [°C].
        lo: lower end of the band of the deformation from the unloaded gear [mm].
        hi: its upper end.
    """
    records = pooled.case.records
    zero = float(np.median(pooled.values["deformation_offset"]))
    # From the unloaded gear, where motion begins, in either sense of loading.
    low = min(0.0, float(np.min(records.deformation)) - zero)
    high = max(0.0, float(np.max(records.deformation)) - zero)
    inside = (lo >= low - NEAR_MM) & (hi <= high + NEAR_MM)
    return inside & temperature_is_tested(records, temperature)
