"""Forces over time for the dynamic model."""

from abc import ABC, abstractmethod

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.theory import Scalar


class Forcing(eqx.Module, ABC):
    """A force as a function of time."""

    @abstractmethod
    def __call__(self, time: Scalar) -> Float[Array, ""]:
        """Return the force [N] at a time [s]."""

    @abstractmethod
    def largest(self) -> Scalar:
        """Return the largest absolute force [N]."""

    @abstractmethod
    def words(self) -> str:
        """Return the force in words."""

    def corners(self) -> Float[Array, " c"] | None:
        """Return the times at which the slope of the force jumps [s], or None."""
        return None


class Step(Forcing):
    """F = A from t = 0 on; the amplitude is A [N]."""

    amplitude: Scalar

    def __call__(self, time: Scalar) -> Float[Array, ""]:
        return jnp.asarray(self.amplitude) + 0.0 * time

    def largest(self) -> Scalar:
        return jnp.abs(self.amplitude)

    def words(self) -> str:
        return f"a step of {self.amplitude:g} N"


class Chirp(Forcing):
    """F = A sin(2π (f₀ t + (f₁ − f₀) t²/(2 D))): a sweep from f₀ to f₁ in D.

    Attributes:
        amplitude: A [N].
        first: f₀, frequency at the start [Hz]; a sine if equal to the last.
        last: f₁, frequency at the end [Hz].
        duration: D [s].
    """

    amplitude: Scalar
    first: Scalar
    last: Scalar
    duration: Scalar

    def __call__(self, time: Scalar) -> Float[Array, ""]:
        rise = 0.5 * (self.last - self.first) / self.duration
        turns = (self.first + rise * time) * time
        return self.amplitude * jnp.sin(2.0 * jnp.pi * turns)

    def largest(self) -> Scalar:
        return jnp.abs(self.amplitude)

    def words(self) -> str:
        if self.first == self.last:
            return f"a sine of {self.amplitude:g} N at {self.first:g} Hz"
        ends = f"from {self.first:g} to {self.last:g} Hz"
        return f"a sweep of {self.amplitude:g} N {ends}"


class SampledForce(Forcing):
    """A force [N] at increasing times [s]: linear between them, constant beyond."""

    time: Float[Array, " n"]
    force: Float[Array, " n"]

    def __call__(self, time: Scalar) -> Float[Array, ""]:
        return jnp.interp(time, self.time, self.force)

    def largest(self) -> Scalar:
        return jnp.max(jnp.abs(self.force))

    def words(self) -> str:
        return f"a sampled force of {len(self.time)} rows, linear between them"

    def corners(self) -> Float[Array, " c"]:
        return jnp.asarray(self.time)
