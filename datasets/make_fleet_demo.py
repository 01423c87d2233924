"""Make datasets/fleet-demo: thirty synthetic gears, one of them soft.

Run from the repository's root:  python datasets/make_fleet_demo.py
The truth is written here and nowhere computed from hdcal: the data are straight lines
in plain NumPy, so that a fault in hdcal cannot hide in them.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

TRUTH = {
    "stiffness_N_per_mm": 200.0,
    "between_gears_percent": 1.2,
    "between_lots_percent": 0.8,
    "between_operators_N": 0.3,
    "between_mountings_N": 0.6,
    "sigma_N": 0.4,
}
# A gear that is off, and its share of the stiffness of the others.
OFF, SHARE = "HD-117", 0.90
GEARS, LOTS, SEED = 30, "ABC", 20261126
HEADER = "specimen,lot,operator,date,run,deformation_mm,force_N"


def simulate() -> Iterator[str]:
    """Yield the lines of the table."""
    rng = np.random.default_rng(SEED)
    up = np.linspace(0.02, 0.48, 8)
    path = np.concatenate([up, up[-2::-1]])
    lots = 1.0 + 0.01 * TRUTH["between_lots_percent"] * rng.standard_normal(len(LOTS))
    operators = TRUTH["between_operators_N"] * np.array([-0.5, 0.5])
    for gear in range(GEARS):
        name, lot = f"HD-{101 + gear}", gear // (GEARS // len(LOTS))
        own = 1.0 + 0.01 * TRUTH["between_gears_percent"] * rng.standard_normal()
        stiffness = TRUTH["stiffness_N_per_mm"] * lots[lot] * own
        stiffness *= SHARE if name == OFF else 1.0
        for mounting, operator in enumerate("KM"):
            day = 1 + 2 * (gear // 3) + mounting
            zero = TRUTH["between_mountings_N"] * rng.standard_normal()
            noise = TRUTH["sigma_N"] * rng.standard_normal(len(path))
            force = stiffness * path + zero + operators[mounting] + noise
            about = f"{name},{LOTS[lot]},{operator},2026-09-{day:02d},{mounting + 1}"
            for x, y in zip(path, force, strict=True):
                yield f"{about},{x:.4f},{y:.3f}"


def main() -> None:
    """Write data.csv into this script's fleet-demo folder."""
    path = Path(__file__).parent / "fleet-demo" / "data.csv"
    path.write_text("\n".join([HEADER, *simulate(), ""]), "utf-8")


if __name__ == "__main__":
    main()
