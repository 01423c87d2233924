"""The response with dry friction is that of slower and simpler computations."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hdcal.data.records import Geometry
from hdcal.physics.frictional_response import frictional_response
from hdcal.physics.linear_response import LinearGear, linear_response

Geometry(0.68, 40.0, 70.0, 62.0, 0.29)  # switches JAX to double precision
MASS, STIFFNESS = 4e-5, 195.0
DAMPING = 2.0 * 0.005 * np.sqrt(MASS * STIFFNESS)
TIME = np.arange(160) * 2e-4
# 40 N, let go within a millisecond.
FORCE = 40.0 * np.clip(1.0 - (TIME - 0.004) / 1e-3, 0.0, 1.0)
HELD = np.array([40.0 / STIFFNESS, 0.0])

respond = jax.jit(frictional_response)


def slow_twin(friction: float, stiffness=lambda _: STIFFNESS) -> np.ndarray:
    """Return the deformation by a stiff solver; the sign is turned over 1 µm/s."""

    def motion(time, state):
        drag = DAMPING * state[1] + friction * np.tanh(state[1] / 1e-3)
        push = np.interp(time, TIME, FORCE) - drag - stiffness(time) * state[0]
        return [state[1], push / MASS]

    exact = {"method": "Radau", "rtol": 1e-7, "atol": 1e-9, "max_step": 1e-3}
    return solve_ivp(motion, (0.0, TIME[-1]), HELD, t_eval=TIME, **exact).y[0]


def found(friction: float, stiffness=STIFFNESS, damping=DAMPING) -> np.ndarray:
    gear = LinearGear(MASS, damping, stiffness)
    return np.asarray(respond(gear, friction, TIME, FORCE, HELD))


def test_without_friction_it_is_the_linear_response():
    rng = np.random.default_rng(0)
    time = np.cumsum(rng.uniform(1e-4, 4e-4, 150))
    force, start = rng.normal(0.0, 40.0, 150), np.array([0.1, -50.0])
    gear = LinearGear(MASS, DAMPING, rng.uniform(190.0, 200.0, 149))
    linear = jax.jit(linear_response)(gear, time, force, start)
    states = respond(gear, 0.0, time, force, start)
    np.testing.assert_allclose(states, linear, rtol=0.0, atol=1e-9)


def test_it_is_that_of_a_stiff_solver_and_of_no_other_friction():
    slow = slow_twin(1.5)
    assert np.abs(found(1.5)[:, 0] - slow).max() < 2e-4
    assert np.abs(found(1.55)[:, 0] - slow).max() > 2e-3


def test_a_stiffness_of_each_step_is_followed():
    middles = 0.5 * (TIME[1:] + TIME[:-1])
    softer = STIFFNESS * (1.0 - 2.0 * middles)
    slow = slow_twin(0.5, lambda time: STIFFNESS * (1.0 - 2.0 * time))
    assert np.abs(found(0.5, softer)[:, 0] - slow).max() < 3e-4
    assert np.abs(found(0.5)[:, 0] - slow).max() > 3e-3


def test_a_free_swing_loses_four_times_the_friction_and_then_rests():
    friction, start = 2.0, np.array([0.2, 0.0])
    time = np.arange(6000) * 1e-5
    gear = LinearGear(MASS, 0.0, STIFFNESS)
    states = respond(gear, friction, time, 0.0 * time, start)
    y = np.asarray(states)[:, 0]
    inner = (np.diff(np.sign(np.diff(y))) != 0).nonzero()[0] + 1
    tops = np.abs(np.r_[y[0], y[inner]])
    lost = -np.diff(tops)[:8]
    np.testing.assert_allclose(lost, 2.0 * friction / STIFFNESS, rtol=2e-3)
    # 0.2 mm are nine times 4 f/2k and a rest: there it stays.
    assert abs(y[-1]) <= friction / STIFFNESS
    assert np.ptp(y[-500:]) == 0.0
    assert np.asarray(states)[-1, 1] == 0.0


def test_a_held_gear_breaks_loose_when_the_force_exceeds_the_friction():
    time = np.linspace(0.0, 1.0, 2001)
    force = 10.0 * time
    gear = LinearGear(MASS, 1.0, STIFFNESS)
    states = np.asarray(respond(gear, 3.0, time, force, np.zeros(2)))
    assert np.all(states[time < 0.2999, 0] == 0.0)
    # From there on it follows slowly: k y + c ẏ + f = F.
    slow = (force - 3.0 - 1.0 * 10.0 / STIFFNESS) / STIFFNESS
    np.testing.assert_allclose(states[-500:, 0], slow[-500:], atol=1e-6)


@pytest.mark.thorough
def test_gradients_and_hessians_are_those_of_differences():
    start = HELD + np.array([0.003, 3.0])
    at = jnp.array([MASS, DAMPING, STIFFNESS, 1.0])

    def size(parts):
        gear, friction = LinearGear(*parts[:3]), parts[3]
        found = frictional_response(gear, friction, TIME, FORCE, start)
        return jnp.sum(found[:, 0] ** 2)

    def slope_twice(parts):
        slope = jax.grad(size)(parts)
        return slope, slope

    # Both in one program, as the search for the mode takes them.
    derived = jax.jit(jax.jacfwd(slope_twice, has_aux=True))
    value = jax.jit(size)
    bend, slope = derived(at)
    for index in range(4):
        step = 1e-6 * at[index]
        up, down = at.at[index].add(step), at.at[index].add(-step)
        difference = (value(up) - value(down)) / (2.0 * step)
        assert float(slope[index]) == pytest.approx(float(difference), rel=1e-5)
        row = (derived(up)[1] - derived(down)[1]) / (2.0 * step)
        np.testing.assert_allclose(bend[index], row, rtol=1e-4)
