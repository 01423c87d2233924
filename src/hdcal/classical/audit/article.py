"""What the article prints: its inputs, formula, tables and claims, and nothing else.

"Study on Flexible Gear Deformation in Harmonic Drive Gear", tables 1 to 4.
"""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from hdcal.data.records import Geometry
from hdcal.physics.theory import RING_SERIES

TITLE = "Study on Flexible Gear Deformation in Harmonic Drive Gear"
# Table 1, and below Table 4; the load height is not given, no claim here needs it.
WALL, RADIUS, LENGTH, POISSON = 0.68, 40.0, 70.0, 0.3
MODULUS = 210e3
DEFORMATION = 0.4
SLOPE_THEORY, SLOPE_MEASURED, INFLUENCE = 1625.19, 210.41, 0.13
CUBIC = (210.41, -15.23, 5.67)
CUBIC_R2 = 0.99
FORCE_CLAIMED, ERROR_CLAIMED = 92.0, 0.05
# Deformation [mm], "original", "revised" and measured force [N].
TABLE_3 = (
    (0.1, 162.52, 21.13, 18.62),
    (0.3, 487.56, 63.38, 56.84),
    (0.5, 812.60, 105.64, 101.92),
    (0.7, 1137.64, 147.89, None),
    (0.9, 1462.68, 190.15, None),
)
# (wall thickness, radius) [mm] -> "original" and "revised" force at 0.4 mm [N].
TABLE_4 = {
    (0.6, 40.0): (459.12, 59.69),
    (0.68, 40.0): (708.33, 92.08),
    (0.76, 40.0): (1039.21, 135.10),
    (0.68, 35.0): (1080.15, 140.42),
    (0.68, 45.0): (520.49, 67.66),
}

Outcome = Literal["holds", "does not hold", "cannot be checked"]


@dataclass(frozen=True)
class Claim:
    """One claim of the article, and what came of checking it.

    Attributes:
        point: number of the audit's point; several claims may share one.
        claim: what the article says.
        formula: what its formula and inputs give, in words.
        data: what its readings give, in words.
        verdict: holds, does not hold, or cannot be checked.
        numbers: what was computed, by name with its unit.
    """

    point: int
    claim: str
    formula: str
    data: str
    verdict: Outcome
    numbers: dict[str, float] = field(default_factory=dict)


def article_gear() -> Geometry:
    """Return the sizes of the article's gear."""
    return Geometry(WALL, RADIUS, LENGTH, load_height=LENGTH, poisson=POISSON)


def outcome(holds: bool) -> Outcome:
    """Return the word for a claim that could be checked."""
    return "holds" if holds else "does not hold"


def printed_slope(gear: Geometry, modulus: float) -> float:
    """Return the slope that the formula gives as printed: the series multiplies.

    P/ω = π E δ³ S / (24 R³), in N/mm for each mm of length, since no length enters.

    Args:
        gear: sizes [mm].
        modulus: E [MPa].
    """
    plate = 1.0 - float(gear.poisson) ** 2
    bending = modulus * float(gear.wall_thickness) ** 3 / plate
    over = plate / (24.0 * float(gear.radius) ** 3)
    return float(np.pi * bending * over * RING_SERIES)


def cubic(deformation: np.ndarray) -> np.ndarray:
    """Return the force of the article's fitted equation [N].

    Args:
        deformation: [mm], shape (n,).
    """
    return np.polyval([*reversed(CUBIC), 0.0], deformation)
