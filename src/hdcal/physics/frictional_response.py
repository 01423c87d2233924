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
from hdcal.physics.linear_response import LinearGear, Scalar, decay_entries

# Steps towards the time of a turn before the last one: enough also where the force
# jumps from row to row. One is enough for a gear that swings freely.
_SEARCH = 4
# Deformation and speed. Two numbers and no array: what runs row after row is then
# fused into few operations.
State = tuple[Scalar, Scalar]


class _Gear(NamedTuple):
    """m [N·s²/mm], c [N·s/mm] and f [N]: what is the same in every step."""

    mass: Scalar
    damping: Scalar
    friction: Scalar


class _Step(NamedTuple):
    """One time step; what does not hang on the state.

    Attributes:
        length: h [s].
        force: F at its beginning [N].
        slope: of the force [N/s].
        stiffness: k [N/mm].
        matrix: of free decay over the whole step, row after row.
        gain: what the force adds over the whole step.
        drag: what friction takes over the whole step from a motion of sense +1.
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

    # A gradient computes each step anew: quicker than to keep some forty numbers of it.
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
    slope = jnp.diff(force) / length
    stiffness = jnp.broadcast_to(stiffness, length.shape)
    matrix = decay_entries(LinearGear(gear.mass, gear.damping, stiffness), length)
    level, rate = _following(gear, stiffness, slope, force[:-1])
    kept = _applied(matrix, (level, rate))
    gain = level + rate * length - kept[0], rate - kept[1]
    held = gear.friction / stiffness
    drag = held * (matrix[0] - 1.0), held * matrix[2]
    return _Step(length, force[:-1], slope, stiffness, matrix, gain, drag)


def _following(gear: _Gear, stiffness, slope, force) -> State:
    """Return the state that follows a force F₀ + s t without swinging."""
    rate = slope / stiffness
    return (force - gear.damping * rate) / stiffness, rate


def _applied(matrix, state: State) -> State:
    """Return the product of a matrix, row after row, and a state."""
    a, b, c, d = matrix
    return a * state[0] + b * state[1], c * state[0] + d * state[1]


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
    acting = force - sense * gear.friction
    level, rate = _following(gear, step.stiffness, step.slope, acting)
    matrix = decay_entries(LinearGear(gear.mass, gear.damping, step.stiffness), after)
    swing = _applied(matrix, (state[0] - level, state[1] - rate))
    return level + rate * after + swing[0], rate + swing[1]


def _advance(gear: _Gear, step: _Step, state: State) -> State:
    """Return the state at the end of a step."""
    sense = jnp.sign(state[1])
    free = _applied(step.matrix, state)
    whole = tuple(
        f + gain + sense * drag
        for f, gain, drag in zip(free, step.gain, step.drag, strict=True)
    )
    rests = (whole[1] * sense < 0.0) | (sense == 0.0)
    at, top = _turn(gear, step, state, whole[1])
    left = _leave(gear, step, at, top)
    return jnp.where(rests, left[0], whole[0]), jnp.where(rests, left[1], whole[1])


def _turn(gear: _Gear, step: _Step, state: State, end):
    """Return when the gear comes to rest [s] and where [mm]; now, if it is at rest.

    By steps of third order from where a straight line turns. Only the last of them is
    differentiated, at a time that counts as given: with a speed of zero there, its
    error has neither a first nor a second derivative. Gradients and Hessians are those
    of the turn itself, at the cost of one step.

    Args:
        gear: mass, damping and friction.
        step: in which it turns.
        state: where it begins.
        end: speed at the end of the step, had it gone on [mm/s].
    """
    sense = jnp.sign(state[1])
    still, turns = sense == 0.0, end * sense < 0.0
    speeds = jnp.where(still, 1.0, jnp.abs(state[1]) + jnp.abs(end))

    def nearer(at):
        y, v = _moved(gear, step, state, sense, step.force, at)
        push = step.force + step.slope * at - step.stiffness * y
        a = (push - gear.damping * v - gear.friction * sense) / gear.mass
        jerk = (step.slope - step.stiffness * v - gear.damping * a) / gear.mass
        # Nothing is asked of a gear that does not turn: no division by zero there.
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
