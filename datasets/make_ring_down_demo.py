"""Make datasets/ring-down-demo: a synthetic gear that is loaded and let go.

Run from the repository's root:  python datasets/make_ring_down_demo.py
The truth is written here and nowhere computed from hdcal: the motion is integrated in
plain NumPy by small steps, so that a fault in hdcal cannot hide in the data.
"""

from pathlib import Path

import numpy as np

TRUTH = {
    "K": 2.45,
    "E0_GPa": 206.0,
    "mass_kg": 0.040,
    "damping_ratio": 0.018,
    "deformation_offset_mm": 0.006,
    "sigma_mm": 0.002,
}
THICKNESS, RADIUS, LENGTH = 0.68, 40.0, 70.0
RATE, ROWS, FINER, SEED = 5000.0, 400, 200, 1


def parameters() -> tuple[float, float, float]:
    """Return mass [N·s²/mm], damping [N·s/mm] and stiffness [N/mm]."""
    series = (np.pi**2 - 8.0) / 16.0
    ring = np.pi * 1e3 * TRUTH["E0_GPa"] * LENGTH * (THICKNESS / RADIUS) ** 3
    stiffness = TRUTH["K"] * ring / (24.0 * series)
    mass = 1e-3 * TRUTH["mass_kg"]
    damping = 2.0 * TRUTH["damping_ratio"] * np.sqrt(stiffness * mass)
    return mass, damping, stiffness


def force_at(time: np.ndarray) -> np.ndarray:
    """Return the force [N]: pushed to 60 N, held, and let go within 2 ms."""
    return np.interp(time, [0.0, 0.010, 0.025, 0.027, 1.0], [0.0, 60.0, 60.0, 0.0, 0.0])


def simulate() -> np.ndarray:
    """Return rows of time [s], force [N] and deformation [mm]."""
    rng = np.random.default_rng(SEED)
    mass, damping, stiffness = parameters()
    step = 1.0 / (RATE * FINER)
    state, rows = np.zeros(2), []

    def motion(time, state):
        pull = force_at(time) - damping * state[1] - stiffness * state[0]
        return np.array([state[1], pull / mass])

    for index in range(ROWS * FINER):
        time = index * step
        if index % FINER == 0:
            rows.append((time, force_at(time), state[0]))
        # Runge and Kutta's classical step.
        a = motion(time, state)
        b = motion(time + step / 2, state + step / 2 * a)
        c = motion(time + step / 2, state + step / 2 * b)
        d = motion(time + step, state + step * c)
        state = state + step / 6 * (a + 2 * b + 2 * c + d)
    table = np.array(rows)
    table[:, 2] += TRUTH["deformation_offset_mm"]
    table[:, 2] += rng.normal(0.0, TRUTH["sigma_mm"], ROWS)
    return table


def main() -> None:
    """Write data.csv beside this script's ring-down-demo folder."""
    path = Path(__file__).parent / "ring-down-demo" / "data.csv"
    np.savetxt(
        path,
        simulate(),
        fmt=["%.4f", "%.2f", "%.4f"],
        delimiter=",",
        header="time_s,force_N,deformation_mm",
        comments="",
    )


if __name__ == "__main__":
    main()
