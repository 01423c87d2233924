"""Every nominal stiffness is what its own mechanics says, and differentiable."""

import dataclasses

import numpy as np
import pytest
from scipy import integrate

from hdcal.data.records import Geometry
from hdcal.physics.theory import THEORIES, cup, peak_stress, ring

E = 210e3


@pytest.fixture(params=sorted(THEORIES))
def theory(request):
    return THEORIES[request.param]


def with_size(gear: Geometry, **sizes: float) -> Geometry:
    return dataclasses.replace(gear, **sizes)


def some_gear(seed: int) -> Geometry:
    rng = np.random.default_rng(seed)
    low = np.array([0.2, 15.0, 10.0, 8.0, 0.05])
    high = np.array([1.5, 120.0, 150.0, 120.0, 0.45])
    return Geometry(*rng.uniform(low, high))


def even_terms(count: int) -> np.ndarray:
    return np.arange(2.0, 2.0 * count + 1.0, 2.0)


def slow_cup(g: Geometry, modulus: float) -> float:
    """The series of the theory, term by term."""
    n = even_terms(4000)
    rigidity = modulus * g.wall_thickness**3 / (12 * (1 - g.poisson**2))
    warp = g.length / 3 + 2 * (1 - g.poisson) * g.radius**2 / (n**2 * g.length)
    compliance = np.sum(1 / ((n**2 - 1) ** 2 * warp))
    lever = (g.length / g.load_height) ** 2
    return np.pi * rigidity / (2 * g.radius**3) * lever / compliance


def castigliano(g: Geometry, modulus: float) -> tuple[float, float]:
    """Return diameter change over F R³/EI, and stiffness, from the moment alone.

    A quarter of the ring between the loads, φ from the unloaded diameter: the moment
    is M₀ − F R (1 − cos φ)/2, with M₀ such that neither end turns.
    """
    force, radius = 3.7, g.radius
    rigidity = modulus * g.length * g.wall_thickness**3 / 12.0

    def lever(phi):
        return 0.5 * force * radius * (1.0 - np.cos(phi))

    quarter = (0.0, np.pi / 2.0)
    fixing = integrate.quad(lever, *quarter, epsabs=1e-13)[0] / (np.pi / 2.0)
    # ∂U/∂F with M proportional to F: 4 ∫ M (M/F) R dφ / EI.
    square = integrate.quad(lambda p: (fixing - lever(p)) ** 2, *quarter, epsabs=1e-12)
    change = 4.0 * radius * square[0] / (force * rigidity)
    return change * rigidity / (force * radius**3), force / (0.5 * change)


def test_the_ring_is_castiglianos():
    gear = some_gear(0)
    constant, stiffness = castigliano(gear, E)
    assert constant == pytest.approx(0.14878, abs=5e-6)
    assert constant == pytest.approx(np.pi / 4.0 - 2.0 / np.pi, rel=1e-12)
    assert float(ring(gear, E)) == pytest.approx(stiffness, rel=1e-12)


def test_the_largest_stress_is_that_of_the_moment_under_the_load():
    gear, read = some_gear(1), 0.4
    moment = float(ring(gear, E)) * read * gear.radius / np.pi
    section = gear.length * gear.wall_thickness**2 / 6.0
    assert peak_stress(gear, E, read) == pytest.approx(moment / section, rel=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_the_cup_in_closed_form(seed):
    gear = some_gear(seed)
    assert float(cup(gear, E)) == pytest.approx(slow_cup(gear, E), rel=1e-10)


def test_an_endless_cup_is_a_tube(gear):
    # Far from the ends warping costs nothing; loaded where the square of the height
    # has its mean over the length, the cup is a ring in plane strain.
    length = 1e6
    long = with_size(gear, length=length, load_height=length / np.sqrt(3.0))
    tube = float(ring(long, E / (1.0 - gear.poisson**2)))
    assert float(cup(long, E)) == pytest.approx(tube, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "size", "exponent"),
    [
        *(("ring", "wall_thickness", 3), ("ring", "radius", -3), ("ring", "length", 1)),
        *(("cup", "wall_thickness", 3), ("cup", "load_height", -2)),
        *(("article", "wall_thickness", 3), ("article", "radius", -3)),
        *(("ring", "load_height", 0), ("ring", "poisson", 0), ("article", "length", 0)),
    ],
)
def test_scaling(gear, name, size, exponent):
    larger = with_size(gear, **{size: 1.3 * getattr(gear, size)})
    ratio = float(THEORIES[name](larger, E) / THEORIES[name](gear, E))
    assert ratio == pytest.approx(1.3**exponent, rel=1e-13)


@pytest.mark.parametrize("name", ["ring", "cup"])
def test_a_gear_twice_as_large_is_twice_as_stiff(gear, name):
    g = gear
    sizes = (g.wall_thickness, g.radius, g.length, g.load_height)
    twice = Geometry(*(2.0 * size for size in sizes), g.poisson)
    ratio = float(THEORIES[name](twice, E) / THEORIES[name](g, E))
    assert ratio == pytest.approx(2.0, rel=1e-13)


def test_linear_in_the_modulus(gear, theory):
    unit = float(theory(gear, 1.0))
    assert float(theory(gear, E)) == pytest.approx(E * unit, rel=1e-13)
