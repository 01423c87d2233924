"""Make datasets/thermal-demo: a synthetic test at three temperatures.

Run from the repository's root:  python datasets/make_thermal_demo.py
The truth is written here and nowhere computed from hdcal: the data are made by the
ring formula in plain NumPy, so that a fault in hdcal cannot hide in them.
"""

from pathlib import Path

import numpy as np

TRUTH = {
    "K": 2.5,
    "E0_GPa": 206.0,
    "alpha_per_K": 3.2e-4,
    "force_offset_N": 1.5,
    "deformation_offset_mm": 0.004,
    "sigma_N": 0.4,
    "thermal_zero_drift_N_per_K": 0.12,
}
THICKNESS, RADIUS, LENGTH, REFERENCE = 0.68, 40.0, 70.0, 20.0
SEED = 20261120


def simulate() -> np.ndarray:
    """Return rows of time [s], temperature [°C], deformation [mm], force [N]."""
    rng = np.random.default_rng(SEED)
    up = np.linspace(0.02, 0.54, 14)
    cycle = np.concatenate([up, up[::-1]])
    # Out of order, so that temperature and time are not the same thing.
    temperature = np.repeat([20.0, 80.0, 50.0], len(cycle))
    deformation = np.tile(cycle, 3)
    time = np.arange(len(deformation)) * 15.0
    series = (np.pi**2 - 8.0) / 16.0
    modulus = (
        1e3 * TRUTH["E0_GPa"] * (1.0 - TRUTH["alpha_per_K"] * (temperature - REFERENCE))
    )
    stiffness = np.pi * modulus * LENGTH * (THICKNESS / RADIUS) ** 3 / (24.0 * series)
    force = (
        TRUTH["K"] * stiffness * (deformation - TRUTH["deformation_offset_mm"])
        + TRUTH["force_offset_N"]
        + TRUTH["thermal_zero_drift_N_per_K"] * (temperature - REFERENCE)
        + rng.normal(0.0, TRUTH["sigma_N"], len(deformation))
    )
    return np.column_stack([time, temperature, deformation, force])


def main() -> None:
    """Write data.csv beside this script's thermal-demo folder."""
    path = Path(__file__).parent / "thermal-demo" / "data.csv"
    np.savetxt(
        path,
        simulate(),
        fmt=["%.0f", "%.1f", "%.3f", "%.3f"],
        delimiter=",",
        header="time_s,temperature_C,deformation_mm,force_N",
        comments="",
    )


if __name__ == "__main__":
    main()
