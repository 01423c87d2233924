"""The response with dry friction: m ÿ + c ẏ + k y + f sgn ẏ = F(t).

While the gear moves one way friction is a constant force: the motion is that of
`linear_response`, in closed form, until the gear turns. There it rests as long as
|F − k y| ≤ f. Within one time step the gear moves, rests and moves on, each of them for
any time or none; steps must therefore be shorter than half a period. A gear that turns
and turns back within one step, as a force that jumps from row to row can make it, is
taken to go on.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.linear_response import (
    LinearGear,
    Scalar,
    State,
    applied,
    decay_entries,
    following,
    whole_steps,
)

# Steps towards the time of a turn before the last one: enough also where the force
# jumps from row to row. One is enough for a gear that swings freely.
_SEARCH = 4


class _Gear(NamedTuple):
    """Constants of all steps: m [N·s²/mm], c [N·s/mm] and f [N]."""

    mass: Scalar
    damping: Scalar
    friction: Scalar


class _Step(NamedTuple):
    """One time step; independent of the state.

    Attributes:
        length: h [s].
        force: F at its beginning [N].
        slope: of the force [N/s].
        stiffness: k [N/mm].
        matrix: of free decay over the whole step, row after row.
        gain: change of the state by the force over the whole step.
        drag: change by friction over the whole step, for a motion of sense +1.
    """

    length: Scalar
    force: Scalar
    slope: Scalar
    stiffness: Scalar
    matrix: tuple[Scalar, ...]
    gain: State
    drag: State


def frictional_response(
    gear: LinearGear,
    friction: Scalar,
    time: Float[Array, " n"],
    force: Float[Array, " n"],
    start: Float[Array, "2"],
) -> Float[Array, "n 2"]:
    """Return deformation [mm] and speed [mm/s] at the rows, row after row.

    Arguments are those of `linear_response`, with steps shorter than half a period, and
    the friction f [N].
    """
    same = _Gear(gear.mass, gear.damping, friction)

    # A gradient recomputes each step, which is faster than to store its numbers.
    @jax.checkpoint
    def advance(state, step):
        state = _advance(same, step, state)
        return state, jnp.stack(state)

    steps = _steps(same, gear.stiffness, time, force)
    _, states = jax.lax.scan(advance, (start[0], start[1]), steps)
    return jnp.concatenate([start[None], states])


def _steps(gear: _Gear, stiffness, time, force) -> _Step:
    """Return all steps, each number an array of one entry per step."""
    length = jnp.diff(time)
    stiffness = jnp.broadcast_to(stiffness, length.shape)
    linear = LinearGear(gear.mass, gear.damping, stiffness)
    matrix, gain = whole_steps(linear, time, force)
    held = gear.friction / stiffness
    drag = held * (matrix[0] - 1.0), held * matrix[2]
    slope = jnp.diff(force) / length
    return _Step(length, force[:-1], slope, stiffness, matrix, gain, drag)


def _moved(gear: _Gear, step: _Step, state: State, sense, force, after) -> State:
    """Return the state some time later, moving in one sense.

    Args:
        gear: mass, damping and friction.
        step: in which it moves.
        state: where it begins.
        sense: +1 or −1.
        force: F where it begins [N].
        after: how long [s].
    """
    linear = LinearGear(gear.mass, gear.damping, step.stiffness)
    level, rate = following(linear, step.slope, force - sense * gear.friction)
    matrix = decay_entries(linear, after)
    swing = applied(matrix, (state[0] - level, state[1] - rate))
    return level + rate * after + swing[0], rate + swing[1]


def _advance(gear: _Gear, step: _Step, state: State) -> State:
    """Return the state at the end of a step."""
    sense = jnp.sign(state[1])
    free = applied(step.matrix, state)
    whole = tuple(
        f + gain + sense * drag
        for f, gain, drag in zip(free, step.gain, step.drag, strict=True)
    )
    rests = (whole[1] * sense < 0.0) | (sense == 0.0)
    at, top = _turn(gear, step, state, whole[1])
    left = _leave(gear, step, at, top)
    return jnp.where(rests, left[0], whole[0]), jnp.where(rests, left[1], whole[1])


def _turn(gear: _Gear, step: _Step, state: State, end):
    """Return when the gear comes to rest [s] and where [mm].

    Iterations of third order from a linear estimate. Only the last of them is
    differentiated, at a time held constant: at a speed of zero its error has neither a
    first nor a second derivative, so gradients and Hessians are those of the turn.

    Args:
        gear: mass, damping and friction.
        step: in which it turns.
        state: where it begins.
        end: speed at the end of the step without a turn [mm/s].
    """
    sense = jnp.sign(state[1])
    still, turns = sense == 0.0, end * sense < 0.0
    speeds = jnp.where(still, 1.0, jnp.abs(state[1]) + jnp.abs(end))

    def nearer(at):
        y, v = _moved(gear, step, state, sense, step.force, at)
        push = step.force + step.slope * at - step.stiffness * y
        a = (push - gear.damping * v - gear.friction * sense) / gear.mass
        jerk = (step.slope - step.stiffness * v - gear.damping * a) / gear.mass
        # No division by zero for a gear that does not turn.
        a = jnp.where(turns & (a != 0.0), a, 1.0)
        late = v / a * (1.0 + 0.5 * v * jerk / a**2)
        return jnp.clip(at - late, 0.0, step.length), y - 0.5 * v**2 / a

    guess = step.length * jnp.abs(state[1]) / speeds
    at = guess
    for _ in range(_SEARCH):
        at, _top = nearer(at)
    at, top = nearer(jax.lax.stop_gradient(at))
    return jnp.where(still, 0.0, at), jnp.where(still, state[0], top)


def _leave(gear: _Gear, step: _Step, at, top) -> State:
    """Return the state at the end of a step in which the gear is at rest.

    Args:
        gear: mass, damping and friction.
        step: in which it rests.
        at: since when [s].
        top: where [mm].
    """
    left = step.length - at
    over = step.force + step.slope * at - step.stiffness * top
    end = over + step.slope * left
    loose = jnp.abs(over) > gear.friction
    stays = ~loose & (jnp.abs(end) <= gear.friction)
    sense = jnp.sign(jnp.where(loose, over, end))
    waits = ~(loose | stays)
    slope = jnp.where(waits, step.slope, 1.0)
    wait = jnp.where(waits, (sense * gear.friction - over) / slope, 0.0)
    force = step.force + step.slope * (at + wait)
    after = jnp.maximum(left - wait, 0.0)
    y, v = _moved(gear, step, (top, 0.0), sense, force, after)
    return jnp.where(stays, top, y), jnp.where(stays, 0.0, v)
