"""The flexspline as an oscillator: m ÿ + c ẏ + g(y, ẏ) = F(t).

The coordinate y is the deformation *as read*, measured from the unloaded gear, and F is
the load that acts on the gear. The restoring force g is that of the calibrated chain
with its instantaneous effects; those with memory and of gauges are left out.

Dry friction is a contact that sticks elastically and slips at its full force, as in the
effect `hysteresis`: its state is a displacement u. No speed enters, so slow motions
stick and slip as fast ones do.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array, Geometry, Records
from hdcal.physics.chain import Base, Reading, predict_reading
from hdcal.physics.effect import Effect
from hdcal.physics.theory import RING_SERIES, Scalar

# Stiffness of the gear over that of the contact that holds it by friction [-]: a stuck
# gear has 20 times its natural frequency, critically damped. The deformation differs
# from that of ideal friction f by at most some 3 % of f/k.
STUCK = 1.0 / 400.0
# Error allowed per step, relative and in shares of the static deformation: without
# friction some 1e-7 of the response after hundreds of periods, with it far below the
# effect of `STUCK`.
_SMOOTH, _STICKING = (1e-9, 1e-11), (1e-6, 1e-8)
MOST_STEPS = 2_000_000
# Parts of the time between two answers in which the largest deformation is looked for.
_BETWEEN = 16


def ring_mass(geometry: Geometry, density: Scalar, radial_per_read: float) -> Scalar:
    """Return the mass that a load moves on a bare ring [N·s²/mm], as read.

    The ring of mass M = 2πRδLρ bends inextensibly as under its two static loads, w = Σ
    aₙ cos nφ with aₙ = ω/((n²−1)² S), n = 2, 4, …, and v′ = −w. Its kinetic energy
    (M/4) Σ ȧₙ² (1 + 1/n²) is shared by two loads that each do the work F δω: m = (M/4)
    Σ (1 + 1/n²)/(n²−1)⁴ / S² = 0.283 M per radial displacement. Read as a diameter
    between a fixed and a moving platen the centre of the ring moves too: m/2 + M/4 per
    displacement read. The density ρ is in N·s²/mm⁴.

    Source: Rayleigh's principle with the static shape of the loaded ring.
    """
    g = geometry
    whole = 2.0 * jnp.pi * g.radius * g.wall_thickness * g.length * density
    # Terms fall as n⁻⁸: these are exact in double precision.
    n = 2.0 * jnp.arange(1, 60)
    shape = jnp.sum((1.0 + n**-2) / (n**2 - 1.0) ** 4) / RING_SERIES**2
    radial = 0.25 * whole * shape
    return radial if radial_per_read == 1.0 else radial / 2.0 + whole / 4.0


class Forcing(eqx.Module):
    """A force [N] at increasing times [s]: linear between them, constant beyond."""

    time: Float[Array, " n"]
    force: Float[Array, " n"]

    def __call__(self, time: Scalar) -> Float[Array, ""]:
        """Return the force [N] at a time [s]."""
        return jnp.interp(time, self.time, self.force)

    @property
    def largest(self) -> Float[Array, ""]:
        """The largest absolute force [N]."""
        return jnp.max(jnp.abs(self.force))


class Oscillator(eqx.Module):
    """One set of parameters of the dynamic model, per millimetre as read.

    Attributes:
        mass: m [N·s²/mm]; 1 kg = 1e-3 N·s²/mm.
        damping: c [N·s/mm], beside that of any effect.
        base: the static force model; its offsets are not used.
        effects: instantaneous ones.
        reading: how the rig reads.
        temperature: of the gear [°C].
        discrepancy: unexplained force [N] at a deformation [mm], or None.
    """

    mass: Scalar
    damping: Scalar
    base: Base
    effects: tuple[Effect, ...]
    reading: Reading
    temperature: Scalar
    discrepancy: Callable[[Scalar], Scalar] | None = None

    @property
    def stiffness(self) -> Float[Array, ""]:
        """Return k without effects at the temperature [N/mm]."""
        rise = self.temperature - self.reading.reference_temperature
        warm = self.base.stiffness * (1.0 - self.base.alpha * rise)
        return jnp.asarray(warm * self.reading.radial_per_read)

    @property
    def frictional(self) -> bool:
        """Return whether the force depends on the sense of the movement."""
        return any("unloading" in effect.needs for effect in self.effects)

    def restoring(
        self, deformation: Scalar, speed: Scalar, sense: Scalar
    ) -> Float[Array, ""]:
        """Return g, the force of the gear against its deformation [N].

        `sense` is the share of the dry friction that acts, from −1 to 1.
        """
        zero, label = jnp.zeros(1), jnp.zeros(1, int)
        records = Records(
            deformation=zero + deformation,
            temperature=zero + self.temperature,
            time=zero,
            angle=zero,
            direction=zero + sense,
            sense=zero + sense,
            rate=zero + speed,
            run=label,
            specimen=label,
            force=zero,
            force_sd=zero,
            known=frozenset(),
        )
        base = replace(self.base, deformation_offset=0.0, force_offset=0.0, sigma=1.0)
        force = predict_reading(base, self.effects, records, self.reading)[0][0]
        if self.discrepancy is not None:
            force = force + self.discrepancy(deformation)
        return force


@jax.jit
def natural_frequency(mass: Scalar, stiffness: Scalar) -> Float[Array, ""]:
    """Return √(k/m)/2π of the undamped linear model [Hz]."""
    return jnp.sqrt(stiffness / mass) / (2.0 * jnp.pi)


def damping_ratio(mass: Scalar, damping: Scalar, stiffness: Scalar):
    """Return ζ = c/(2√(k m)); 1 is critical damping [-]."""
    return damping / (2.0 * jnp.sqrt(stiffness * mass))


class IntegratedMotion(NamedTuple):
    """Deformation [mm] and speed [mm/s] at the times.

    `largest` is the largest size of the deformation, also between the times [mm].
    `done`: the integration came to its end within the number of steps; `gone`: at the
    reach.
    """

    deformation: Float[Array, " n"]
    speed: Float[Array, " n"]
    largest: Float[Array, ""]
    done: Float[Array, ""]
    gone: Float[Array, ""]


def integrate(
    oscillator: Oscillator,
    force: Forcing,
    times: Float[Array, " n"],
    reach: Scalar = jnp.inf,
) -> IntegratedMotion:
    """Integrate the equation of motion from rest and zero deformation.

    Time is counted in radians of the natural frequency and speed in the deformation
    that goes with it, so that one tolerance serves gears of every size. Motion begins
    at the first of the increasing times [s] and ends at a deformation of `reach` [mm]:
    a gear that gives way there accelerates without end.
    """
    # Half a second, which only motion needs.
    import diffrax

    pace = jnp.sqrt(oscillator.stiffness / oscillator.mass)
    size = force.largest / oscillator.stiffness
    size = jnp.where(size > 0.0, size, 1.0)
    slip, lag = _slip(oscillator, size) / size, 2.0 * jnp.sqrt(STUCK)

    def motion(tau, state, _):
        y, v, u = state
        held = jnp.clip(u + lag * v, -slip, slip) if oscillator.frictional else u
        drag = oscillator.damping * v * size * pace
        drag += oscillator.restoring(y * size, v * size * pace, held / slip)
        push = force(times[0] + tau / pace) - drag
        return jnp.stack([v, push / (oscillator.stiffness * size), (held - u) / lag])

    relative, absolute = _STICKING if oscillator.frictional else _SMOOTH
    # A step ends at each corner of the force, so that none is smoothed.
    controller = diffrax.ClipStepSizeController(
        diffrax.PIDController(rtol=relative, atol=absolute),
        step_ts=(jnp.asarray(force.time) - times[0]) * pace,
    )
    shown = (jnp.asarray(times) - times[0]) * pace
    found = diffrax.diffeqsolve(
        diffrax.ODETerm(motion),
        diffrax.Dopri8(),
        t0=shown[0],
        t1=shown[-1],
        dt0=None,
        y0=jnp.zeros(3),
        saveat=diffrax.SaveAt(ts=shown),
        stepsize_controller=controller,
        max_steps=MOST_STEPS,
        event=diffrax.Event(lambda t, y, args, **_: jnp.abs(y[0]) * size > reach),
        throw=False,
    )
    deformation, speed = jnp.asarray(found.ys)[:, :2].T
    deformation, speed = deformation * size, speed * size * pace
    done = found.result == diffrax.RESULTS.successful
    done &= jnp.all(jnp.isfinite(deformation) & jnp.isfinite(speed))
    gone = found.result == diffrax.RESULTS.event_occurred
    largest = _largest(times, deformation, speed)
    return IntegratedMotion(deformation, speed, largest, done, gone)


def _largest(times, deformation, speed) -> Float[Array, ""]:
    """Return the largest size, by the cubic through deformations and speeds."""
    step = jnp.diff(times)
    y, end = deformation[:-1], deformation[1:]
    slope, slope_end = step * speed[:-1], step * speed[1:]

    def at(share):
        left = (1.0 - share) ** 2 * (y * (1.0 + 2.0 * share) + slope * share)
        right = share**2 * (end * (3.0 - 2.0 * share) - slope_end * (1.0 - share))
        return jnp.max(jnp.abs(left + right))

    # One share after the other: all at once fill the memory.
    return jnp.max(jax.lax.map(at, jnp.linspace(0.0, 1.0, _BETWEEN + 1)))


def _slip(oscillator: Oscillator, size: Scalar) -> Float[Array, ""]:
    """Return the movement at which a contact at rest slips [mm].

    `size` is the static deformation under the largest force.
    """
    stuck, free = (oscillator.restoring(size, 0.0, sense) for sense in (1.0, 0.0))
    slip = STUCK * (stuck - free) / oscillator.stiffness
    return jnp.maximum(slip, _STICKING[1] * size)
