"""Claims about the formula: what it gives, and what a ring really gives."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from hdcal.classical.audit.article import (
    DEFORMATION,
    LENGTH,
    MODULUS,
    POISSON,
    RADIUS,
    SLOPE_THEORY,
    TABLE_3,
    TABLE_4,
    WALL,
    Claim,
    article_gear,
    outcome,
    printed_slope,
)
from hdcal.physics.theory import RING_SERIES, ring

# Two numbers of the article that differ by more were not computed from each other.
_SAME = 0.005
# Diameter change of a ring in F R³/(E I), by Castigliano: no series in it.
_CASTIGLIANO = np.pi / 4.0 - 2.0 / np.pi


def theory_claims() -> Iterator[Claim]:
    """Yield what came of the claims about the formula (points 1 to 4 and 6)."""
    yield _series()
    yield _length()
    yield _slope()
    yield _poisson()
    yield _table_3()
    yield _table_4()


def _series() -> Claim:
    factor = 1.0 / RING_SERIES**2
    inertia = LENGTH * WALL**3 / 12.0
    by_hand = 2.0 * MODULUS * inertia / (_CASTIGLIANO * RADIUS**3)
    right = float(ring(article_gear(), MODULUS))
    return Claim(
        1,
        "The force is multiplied by the series S = Σ 1/(n²−1)², n = 2, 4, 6, …",
        f"Least bending energy divides by S = {RING_SERIES:.4f}, as Castigliano's "
        f"ring does ({by_hand:.3f} N/mm): multiplying is S² = {RING_SERIES**2:.5f} of "
        f"that, a factor of {factor:.1f} too little",
        "–",
        outcome(abs(factor - 1.0) < _SAME),
        {
            "S": RING_SERIES,
            "S_squared": RING_SERIES**2,
            "factor": factor,
            "ring_N_per_mm": right,
            "castigliano_N_per_mm": by_hand,
        },
    )


def _length() -> Claim:
    gear = article_gear()
    longer = replace(gear, length=2.0 * LENGTH)
    printed = printed_slope(longer, MODULUS) / printed_slope(gear, MODULUS)
    true = float(ring(longer, MODULUS)) / float(ring(gear, MODULUS))
    return Claim(
        2,
        "P is the deforming force of the gear, in newtons",
        f"No length enters: P is a force per mm of length. L = {LENGTH:g} mm is "
        f"listed and never used, another factor of {LENGTH:g}",
        "–",
        outcome(abs(printed / true - 1.0) < _SAME),
        {"factor": LENGTH, "twice_the_length_printed": printed},
    )


def _slope() -> Claim:
    per_length = printed_slope(article_gear(), MODULUS)
    right = float(ring(article_gear(), MODULUS))
    lacking = SLOPE_THEORY / right
    needed = {
        "needed_wall_thickness_mm": WALL * lacking ** (1 / 3),
        "needed_radius_mm": RADIUS / lacking ** (1 / 3),
        "needed_modulus_GPa": MODULUS * lacking / 1e3,
        "needed_length_mm": LENGTH * lacking,
    }
    thick, radius, modulus, length = needed.values()
    found = (per_length, per_length * LENGTH, right)
    return Claim(
        3,
        f"The theoretical slope is K₁ = {SLOPE_THEORY:g} N/mm",
        f"As printed {per_length:.6f} per mm of length, times L {found[1]:.5f}, "
        f"corrected {right:.3f} N/mm. For {SLOPE_THEORY:g} it would take δ = "
        f"{thick:.3f} mm, or R = {radius:.2f} mm, or E = {modulus:.0f} GPa, or L = "
        f"{length:.0f} mm",
        "–",
        outcome(any(abs(SLOPE_THEORY / slope - 1.0) < _SAME for slope in found)),
        {
            "printed_per_length_N_per_mm2": per_length,
            "printed_times_length_N_per_mm": found[1],
            "corrected_N_per_mm": right,
            **needed,
        },
    )


def _poisson() -> Claim:
    gear = article_gear()
    without = replace(gear, poisson=0.0)
    change = printed_slope(gear, MODULUS) / printed_slope(without, MODULUS) - 1.0
    tube = 1.0 / (1.0 - POISSON**2) - 1.0
    return Claim(
        4,
        f"Poisson's ratio ν = {POISSON:g} is an input of the force",
        f"D (1−ν²) cancels it: ν = 0 gives the same force. In a long closed tube it "
        f"would add {tube:.1%}",
        "–",
        outcome(abs(change) > _SAME),
        {"change_by_poisson": change, "long_tube": tube},
    )


def _table_3() -> Claim:
    at, original = np.array([row[:2] for row in TABLE_3]).T
    per_mm = original / at
    right = float(ring(article_gear(), MODULUS))
    return Claim(
        5,
        "Table 3 lists the theoretical force",
        f"It is {original[0]:g} N times {', '.join(f'{x:.0f}' for x in at / at[0])}: "
        f"one slope of {per_mm.mean():.1f} N/mm, the K₁ that its formula does not "
        "give",
        "–",
        outcome(abs(per_mm.mean() / right - 1.0) < _SAME),
        {"slope_N_per_mm": float(per_mm.mean()), "spread": float(np.ptp(per_mm))},
    )


def _exponent(first, second, axis: int) -> float:
    force = np.log(TABLE_4[second][0] / TABLE_4[first][0])
    return float(force / np.log(second[axis] / first[axis]))


def _table_4() -> Claim:
    here = (WALL, RADIUS)
    wall = [_exponent((0.6, 40.0), here, 0), _exponent(here, (0.76, 40.0), 0)]
    radius = [_exponent((0.68, 35.0), here, 1), _exponent(here, (0.68, 45.0), 1)]
    implied = TABLE_4[here][0] / DEFORMATION
    cube = max(abs(e / 3.0) - 1.0 for e in (*wall, *radius))
    return Claim(
        6,
        "Table 4 follows the formula, δ³/R³",
        f"Between its rows the exponent of δ is {wall[0]:.3f} and {wall[1]:.3f}, that "
        f"of R {radius[0]:.3f} and {radius[1]:.3f}. Its row for the tested gear "
        f"implies {implied:.1f} N/mm, not {SLOPE_THEORY:g}",
        "–",
        outcome(cube < 0.02 and abs(implied / SLOPE_THEORY - 1.0) < _SAME),
        {
            "thickness_exponent_low": wall[0],
            "thickness_exponent_high": wall[1],
            "radius_exponent_low": radius[0],
            "radius_exponent_high": radius[1],
            "implied_slope_N_per_mm": implied,
        },
    )
