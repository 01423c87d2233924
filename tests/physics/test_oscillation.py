"""The integrated motion is that of the textbook, and of its exact linear twin."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hdcal import EFFECTS
from hdcal.data.records import Geometry
from hdcal.physics.chain import Base, Reading
from hdcal.physics.dynamics import (
    Forcing,
    Oscillator,
    integrate,
    natural_frequency,
    ring_mass,
)
from hdcal.physics.linear_response import LinearGear, linear_response
from hdcal.physics.theory import ring

XB1 = Geometry(0.68, 40.0, 70.0, 62.0, 0.29)
MASS, STIFFNESS, FORCE = 4e-5, 200.0, 80.0
PACE = np.sqrt(STIFFNESS / MASS)
TIMES = np.linspace(0.0, 0.05, 401)
RATIOS = [0.0, 1.0, 2.5]


def gear(ratio: float, effects=(), reading=None) -> Oscillator:
    """Return an oscillator of a given damping ratio."""
    base = Base(STIFFNESS, 0.0, 0.0, 0.0, 1.0)
    reading = reading or Reading(1.0, 20.0)
    damping = 2.0 * ratio * np.sqrt(STIFFNESS * MASS)
    return Oscillator(MASS, damping, base, effects, reading, 20.0)


STEP = Forcing(np.zeros(1), np.full(1, FORCE))


class Sine(Forcing):
    frequency: float

    def __call__(self, time):
        return FORCE * jnp.sin(2.0 * jnp.pi * self.frequency * time)


def sine(frequency: float) -> Sine:
    return Sine(STEP.time, STEP.force, frequency)


@jax.jit
def move(oscillator, force, times):
    """Return the integrated motion."""
    motion = integrate(oscillator, force, times)
    states = jnp.stack([motion.deformation, motion.speed], axis=1)
    return jnp.where(motion.done, states, jnp.nan)


exact_response = jax.jit(linear_response)


def step_response(ratio: float, times) -> np.ndarray:
    """Return the deformation after a step from rest, from the textbook [mm]."""
    rest, tau = FORCE / STIFFNESS, PACE * times
    if ratio == 1.0:
        return rest * (1.0 - np.exp(-tau) * (1.0 + tau))
    root = np.emath.sqrt(ratio**2 - 1.0)
    fast, slow = -ratio - root, -ratio + root
    free = (fast * np.exp(slow * tau) - slow * np.exp(fast * tau)) / (slow - fast)
    return np.real(rest * (1.0 + free))


def sine_response(ratio: float, frequency: float, times) -> np.ndarray:
    """Return steady state and transient under a sine from rest, by residues [mm].

    Y(s) = (A/m) Ω / ((s² + Ω²)(s − p₁)(s − p₂)) for simple poles.
    """
    root = np.emath.sqrt(ratio**2 - 1.0)
    drive = 2.0 * np.pi * frequency
    poles = [PACE * (-ratio + root), PACE * (-ratio - root), 1j * drive, -1j * drive]
    total = np.zeros(len(times), complex)
    for index, pole in enumerate(poles):
        others = np.prod([pole - p for i, p in enumerate(poles) if i != index])
        total += np.exp(pole * times) / others
    return np.real(FORCE / MASS * drive * total)


def worst(found, expected) -> float:
    """Return the largest error relative to the largest value."""
    return float(np.max(np.abs(found - expected)) / np.max(np.abs(expected)))


@pytest.mark.parametrize("ratio", RATIOS)
def test_a_step_is_answered_as_in_the_textbook(ratio):
    expected = step_response(ratio, TIMES)
    assert worst(move(gear(ratio), STEP, TIMES)[:, 0], expected) < 1e-7
    force, rest = np.full(len(TIMES), FORCE), np.zeros(2)
    linear = LinearGear(MASS, gear(ratio).damping, STIFFNESS)
    exact = exact_response(linear, TIMES, force, rest)[:, 0]
    assert worst(exact, expected) < 1e-11


@pytest.mark.parametrize(("ratio", "frequency"), [(0.015, 350.0), (2.5, 5.0)])
def test_a_sine_is_answered_as_in_the_textbook(ratio, frequency):
    expected = sine_response(ratio, frequency, TIMES)
    found = move(gear(ratio), sine(frequency), TIMES)[:, 0]
    assert worst(found, expected) < 1e-7


@pytest.mark.parametrize("ratio", [0.015, 1.0])
def test_a_sampled_force_is_followed_exactly_at_uneven_times(ratio):
    rng = np.random.default_rng(1)
    time = np.sort(rng.uniform(0.0, 0.05, 80))
    force = rng.normal(0.0, 40.0, 80)
    linear = LinearGear(MASS, gear(ratio).damping, STIFFNESS)
    exact = exact_response(linear, time, force, np.zeros(2))
    found = move(gear(ratio), Forcing(time, force), time)
    assert worst(found[:, 0], exact[:, 0]) < 1e-6
    assert worst(found[:, 1], exact[:, 1]) < 1e-6


@pytest.mark.parametrize("friction", [2.0, 20.0])
def test_dry_friction_takes_four_times_itself_of_each_swing(friction):
    """Half a swing goes from one side of (F ∓ f)/k to the other, then the gear rests.

    To 3 % of f/k, the range in which friction holds a gear without load.
    """
    rubbed = gear(0.0, (EFFECTS["coulomb_friction"](force=friction),))
    halves = np.arange(5) * np.pi / PACE
    found = move(rubbed, STEP, np.append(halves, 100.0 * halves[1]))[:, 0]
    expected, sense = [0.0], 1.0
    for _ in halves[1:]:
        turn, middle = expected[-1], (FORCE - sense * friction) / STIFFNESS
        rests = abs(FORCE - STIFFNESS * turn) <= friction
        expected.append(turn if rests else 2.0 * middle - turn)
        sense = -sense
    assert found[:-1] == pytest.approx(expected, abs=0.03 * friction / STIFFNESS)
    assert abs(found[-1] - FORCE / STIFFNESS) < 1.03 * friction / STIFFNESS


@pytest.mark.parametrize(
    ("effect", "held"),
    [
        (EFFECTS["load_friction"](share=0.1), lambda y, way: 0.1 * STIFFNESS * y * way),
        (EFFECTS["coulomb_friction"](force=8.0), lambda y, way: 8.0 * way),
    ],
)
def test_friction_sticks_and_slips_in_a_slow_motion(effect, held):
    """Quasi-static, k y ± f(y) = F on the way out and back; it sticks at the turn."""
    times = np.array([0.0, 2.4, 2.6, 4.9])
    found = np.asarray(move(gear(0.015, (effect,)), sine(0.1), times)[1:, 0])
    loads = FORCE * np.sin(0.2 * np.pi * times[1:])
    for y, load, way in zip(found[[0, 2]], loads[[0, 2]], (1.0, -1.0), strict=True):
        assert STIFFNESS * y + held(y, way) == pytest.approx(load, rel=0.005)
    largest = (FORCE - held(found[0], 1.0)) / STIFFNESS
    assert found[1] == pytest.approx(largest, rel=0.005)


def test_hardening_raises_the_frequency_and_keeps_the_energy():
    hard = EFFECTS["progressive_stiffening"](slope=0.8)
    states = np.asarray(move(gear(0.0, (hard,)), STEP, TIMES))
    y, speed = states.T
    # g = k y (1 + a y) for y > 0: work done is kinetic plus stored energy.
    stored = STIFFNESS * (y**2 / 2.0 + 0.8 * y**3 / 3.0)
    energy = 0.5 * MASS * speed**2 + stored
    assert y.min() > -1e-3
    assert worst(energy, FORCE * y) < 2e-3
    assert y.max() < step_response(0.0, TIMES).max() - 0.05


def test_the_mass_of_the_ring_is_rayleighs():
    density, modulus = 7.85e-9, 207e3
    mass = float(ring_mass(XB1, density, 1.0))
    whole = 2.0 * np.pi * 40.0 * 0.68 * 70.0 * density
    assert mass == pytest.approx(0.28295 * whole, rel=1e-4)
    found = float(natural_frequency(mass, ring(XB1, modulus)))
    # The exact n = 2 mode of a free ring, (6/√5) √(EI/(ρ A R⁴)): the static shape
    # lies above it, as Rayleigh's quotient must, and not by much.
    exact = 6.0 / 5**0.5 * np.sqrt(modulus * 0.68**2 / (12.0 * density * 40.0**4))
    assert 1.0 < found / (exact / (2.0 * np.pi)) < 1.03


@pytest.mark.parametrize(("reach", "ends"), [(1.9, True), (2.1, False)])
def test_it_is_not_followed_beyond_its_reach(reach, ends):
    """An undamped gear swings to twice its deformation at rest."""
    static = FORCE / STIFFNESS
    asked = gear(0.0), STEP, TIMES, reach * static
    motion = jax.jit(integrate)(*asked)
    assert (bool(motion.gone), bool(motion.done)) == (ends, not ends)


@pytest.mark.parametrize("points", [15, 401])
def test_the_peak_is_that_of_the_motion_and_not_of_the_points(points):
    """An undamped gear swings to twice its deformation at rest."""
    times = np.linspace(0.0, 0.0047, points)
    found = jax.jit(integrate)(gear(0.0), STEP, times)
    assert float(found.largest) == pytest.approx(2.0 * FORCE / STIFFNESS, rel=1e-3)
