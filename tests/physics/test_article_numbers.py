"""The article's gear and its Table 2 give the numbers of docs/validation/audit.md."""

import numpy as np
import pytest
from commands import XB1

from hdcal.classical.fit import fit
from hdcal.data.reading import read_case
from hdcal.physics.theory import RING_SERIES, article, ring

E = 210e3
# Powers of the deformation, coefficients, residual sd [N], R².
FITS = [
    ([1], [198.02], 2.727, 0.99396),
    ([0, 1], [-4.247, 209.41], 1.678, 0.99789),
    ([1, 2], [168.15, 71.2], 0.928, 0.99935),
    ([0, 1, 2], [-1.177, 176.61, 58.58], 0.864, 0.99949),
    ([0, 1, 2, 3], [-1.384, 180.98, 39.12, 23.17], 0.902, 0.99949),
]


@pytest.fixture(scope="module")
def table() -> tuple[np.ndarray, np.ndarray]:
    """Table 2: deformation [mm] and force [N]."""
    return tuple(np.loadtxt(XB1 / "data.csv", delimiter=",", skiprows=1).T)


def test_the_series_divides(gear):
    even = np.arange(2.0, 4000.0, 2.0)
    assert pytest.approx(np.sum((even**2 - 1.0) ** -2.0), abs=1e-10) == RING_SERIES
    assert float(ring(gear, E)) == pytest.approx(80.905, abs=5e-4)
    slenderness = gear.wall_thickness / gear.radius
    printed = np.pi * E * slenderness**3 * RING_SERIES / 24.0
    assert printed == pytest.approx(0.015781, abs=5e-7)
    assert float(ring(gear, E)) / (printed * gear.length) == pytest.approx(
        73.2, abs=0.05
    )


@pytest.mark.parametrize(("powers", "coefficients", "sd", "r2"), FITS)
def test_least_squares_of_table_2(table, powers, coefficients, sd, r2):
    """By NumPy's least squares, and by `hdcal.fit`."""
    deformation, force = table
    design = deformation[:, None] ** np.array(powers)
    found, squares, *_ = np.linalg.lstsq(design, force, rcond=None)
    digits = [len(str(number).partition(".")[2]) for number in coefficients]
    rounded = [round(float(c), d) for c, d in zip(found, digits, strict=True)]
    assert rounded == coefficients
    assert round(float(np.sqrt(squares[0] / (len(force) - len(powers)))), 3) == sd
    about_mean = np.sum((force - force.mean()) ** 2)
    assert round(float(1.0 - squares[0] / about_mean), 5) == r2
    (own,) = (
        one
        for one in fit(read_case(str(XB1)), [1, 2, 3]).fits
        if [each.power for each in one.coefficients] == powers
    )
    values = [each.value for each in own.coefficients]
    np.testing.assert_allclose(values, found, rtol=1e-9)


@pytest.mark.parametrize(
    ("theory", "expected"), [(article, (0.1289, 0.1218)), (ring, (2.588, 2.448))]
)
def test_the_influence_coefficient(gear, table, theory, expected):
    """With the slope of the line with intercept, and of the line through zero."""
    deformation, force = table
    slopes = (
        np.polyfit(deformation, force, 1)[0],
        deformation @ force / (deformation @ deformation),
    )
    assert np.divide(slopes, theory(gear, E)) == pytest.approx(expected, abs=5e-4)
