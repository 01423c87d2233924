"""The article's numbers against its own data and formula, as the audit states them."""

from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from hdcal.physics.theory import RING_SERIES, article, ring

ROOT = Path(__file__).parents[2]
E = 210e3
CLAIMED_SLOPE, CLAIMED_K = 1625.19, 0.13
# Table 3: deformation [mm], "original" and "revised" force [N].
TABLE_3 = np.array(
    [
        (0.1, 162.52, 21.13),
        (0.3, 487.56, 63.38),
        (0.5, 812.60, 105.64),
        (0.7, 1137.64, 147.89),
        (0.9, 1462.68, 190.15),
    ]
)
# Table 4: (wall thickness, radius) [mm] -> force at 0.4 mm [N].
TABLE_4 = {
    (0.6, 40): 459.12,
    (0.68, 40): 708.33,
    (0.76, 40): 1039.21,
    (0.68, 35): 1080.15,
    (0.68, 45): 520.49,
}
REVISED_FORCE = 92.08


@pytest.fixture(scope="module")
def table() -> tuple[np.ndarray, np.ndarray]:
    """Table 2: deformation [mm] and force [N]."""
    path = ROOT / "datasets" / "xb1-100-80" / "data.csv"
    return tuple(np.loadtxt(path, delimiter=",", skiprows=1).T)


def least_squares(table, powers):
    """Return coefficients, residual sd and R² of a polynomial."""
    deformation, force = table
    design = deformation[:, None] ** np.array(powers)
    coefficients = np.linalg.lstsq(design, force, rcond=None)[0]
    residual = force - design @ coefficients
    squares = residual @ residual
    sd = np.sqrt(squares / (len(force) - len(powers)))
    return coefficients, sd, 1.0 - squares / np.sum((force - force.mean()) ** 2)


def f_test(table, small, large):
    """Return F and its p of the one term that `large` has more than `small`."""
    (_, sd_small, _), (_, sd_large, _) = (
        least_squares(table, powers) for powers in (small, large)
    )
    free = len(table[0]) - len(large)
    gain = sd_small**2 * (free + 1) - sd_large**2 * free
    ratio = gain / sd_large**2
    return ratio, stats.f.sf(ratio, 1, free)


def as_printed(gear):
    """The article's formula for a force per mm of length: S multiplies."""
    slender = gear.wall_thickness / gear.radius
    return np.pi * E * slender**3 * RING_SERIES / 24.0


def test_the_slope_as_printed_and_as_it_should_be(gear):
    printed, right = as_printed(gear), float(ring(gear, E))
    assert printed == pytest.approx(0.015781, abs=5e-7)
    assert printed * gear.length == pytest.approx(1.10467, abs=5e-6)
    assert right == pytest.approx(80.905, abs=5e-4)
    assert right / (printed * gear.length) == pytest.approx(73.2, abs=0.05)
    assert pytest.approx(0.01365, abs=5e-6) == RING_SERIES**2


def test_what_the_claimed_slope_would_need(gear):
    lacking = CLAIMED_SLOPE / float(ring(gear, E))
    assert gear.wall_thickness * lacking ** (1 / 3) == pytest.approx(1.848, abs=1e-3)
    assert gear.radius / lacking ** (1 / 3) == pytest.approx(14.71, abs=5e-3)
    assert E * lacking / 1e3 == pytest.approx(4218, abs=0.5)
    assert gear.length * lacking == pytest.approx(1406, abs=0.5)


def test_table_3_is_one_number_times_odd_ones(table):
    original, revised = TABLE_3[:, 1], TABLE_3[:, 2]
    np.testing.assert_allclose(original, 162.52 * np.array([1, 3, 5, 7, 9]), rtol=1e-12)
    np.testing.assert_allclose(revised, CLAIMED_K * original, atol=0.006)
    assert original[0] == pytest.approx(0.1 * CLAIMED_SLOPE, abs=0.005)
    assert (TABLE_3[:, 0] > table[0].max()).tolist() == [False] * 3 + [True] * 2


def test_table_4_follows_no_cube(gear):
    def exponent(first, second, axis):
        force = np.log(TABLE_4[second] / TABLE_4[first])
        return force / np.log(second[axis] / first[axis])

    here = (0.68, 40)
    assert exponent((0.6, 40), here, 0) == pytest.approx(3.464, abs=5e-4)
    assert exponent(here, (0.76, 40), 0) == pytest.approx(3.446, abs=5e-4)
    assert exponent((0.68, 35), here, 1) == pytest.approx(-3.160, abs=5e-4)
    assert exponent(here, (0.68, 45), 1) == pytest.approx(-2.616, abs=5e-4)
    implied = TABLE_4[here] / 0.4
    assert implied == pytest.approx(1770.8, abs=0.05)
    assert implied > 1.08 * float(article(gear, E))


def test_three_forces_at_the_design_deformation(table):
    rule = CLAIMED_K * CLAIMED_SLOPE * 0.4
    measured = np.interp(0.4, *table)
    assert rule == pytest.approx(84.5, abs=0.05)
    assert CLAIMED_K * TABLE_4[0.68, 40] == pytest.approx(REVISED_FORCE, abs=0.01)
    assert pytest.approx(92.1, abs=0.05) == REVISED_FORCE
    assert measured == pytest.approx(78.4, abs=1e-9)
    assert REVISED_FORCE / measured - 1.0 == pytest.approx(0.17, abs=0.005)


# Powers of the deformation, coefficients, residual sd [N], R².
FITS = [
    ([1], [198.02], 2.727, 0.99396),
    ([0, 1], [-4.247, 209.41], 1.678, 0.99789),
    ([1, 2], [168.15, 71.2], 0.928, 0.99935),
    ([0, 1, 2], [-1.177, 176.61, 58.58], 0.864, 0.99949),
    ([0, 1, 2, 3], [-1.384, 180.98, 39.12, 23.17], 0.902, 0.99949),
]


@pytest.mark.parametrize(("powers", "coefficients", "sd", "r2"), FITS)
def test_least_squares_of_table_2(table, powers, coefficients, sd, r2):
    found = least_squares(table, powers)
    digits = [len(str(number).partition(".")[2]) for number in coefficients]
    rounded = [round(float(c), d) for c, d in zip(found[0], digits, strict=True)]
    assert rounded == coefficients
    assert round(float(found[1]), 3) == sd
    assert round(float(found[2]), 5) == r2


def test_the_curvature_is_real_convex_and_enough(table):
    ratio, chance = f_test(table, [0, 1], [0, 1, 2])
    assert ratio == pytest.approx(34.2, abs=0.05)
    assert chance == pytest.approx(1e-4, rel=0.2)
    assert least_squares(table, [0, 1, 2])[0][2] > 0.0
    assert f_test(table, [0, 1, 2], [0, 1, 2, 3])[1] == pytest.approx(0.76, abs=0.005)


def test_the_articles_cubic_is_no_fit_of_its_data(table):
    deformation, force = table
    residual = force - (
        210.41 * deformation - 15.23 * deformation**2 + 5.67 * deformation**3
    )
    assert np.count_nonzero(residual < 0.0) == 13
    assert np.sqrt(np.mean(residual**2)) == pytest.approx(3.77, abs=5e-3)
    r2 = 1.0 - residual @ residual / np.sum((force - force.mean()) ** 2)
    assert r2 == pytest.approx(0.98759, abs=5e-6)
    assert r2 < 0.99
    # Concave over the tested range, where the data are convex.
    assert np.all(-2.0 * 15.23 + 6.0 * 5.67 * deformation < 0.0)


def test_the_scale_was_read_in_tenths_of_a_kilogram_force(table):
    ticks = table[1] / 0.98
    on_tick = np.isclose(ticks, np.round(ticks), atol=1e-9)
    assert np.count_nonzero(on_tick) == 12
    assert table[1][~on_tick].tolist() == [49.11, 111.58]


@pytest.mark.parametrize(("powers", "size"), [([0, 1], 1.93), ([0, 1, 2], 1.55)])
def test_one_suspicious_point(table, powers, size):
    deformation, force = table
    design = deformation[:, None] ** np.array(powers)
    residual = force - design @ least_squares(table, powers)[0]
    assert residual[2] == pytest.approx(size, abs=5e-3)
    # The line leaves its curvature at the ends; between them nothing lies so high.
    assert deformation[1 + np.argmax(residual[1:-1])] == 0.10
    if 2 in powers:
        assert np.argmax(np.abs(residual)) == 2


@pytest.mark.parametrize(
    ("theory", "with_intercept", "through_origin", "digits"),
    [(article, 0.1289, 0.1218, 4), (ring, 2.59, 2.45, 2)],
)
def test_the_influence_coefficient(
    gear, table, theory, with_intercept, through_origin, digits
):
    nominal = float(theory(gear, E))
    slope = least_squares(table, [0, 1])[0][1]
    assert round(slope / nominal, digits) == with_intercept
    # The theory's own reading: no force at no deformation.
    assert round(least_squares(table, [1])[0][0] / nominal, digits) == through_origin
