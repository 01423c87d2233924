"""Departures of the reading noise from a normal distribution of constant sd."""

import jax.numpy as jnp

from hdcal.physics.effect import Effect, Noise, Rows, parameter
from hdcal.physics.theory import Scalar


class Quantisation(Effect, stage="noise", family="noise"):
    """Rounding to a grid of step q seen as noise: sd² → sd² + q²/12.

    Readings come in steps of the display.

    Source: Sheppard, Proc. London Math. Soc. 29 (1898), correction of the variance.
    """

    step: Scalar = parameter("N", "step of the readings", typical=0.98, null=0.0)

    def apply(self, signal: Noise, rows: Rows) -> Noise:
        sd = jnp.sqrt(signal.sd**2 + self.step**2 / 12.0)
        return Noise(signal.log_weight, sd)


class HeteroscedasticNoise(Effect, stage="noise", family="noise"):
    """A part of the noise in proportion to the load: sd² → sd² + (s k ω)².

    The noise grows with the force.

    Source: Carroll and Ruppert, Transformation and Weighting in Regression (1988).
    """

    share: Scalar = parameter(
        "1",
        "noise per force, in addition to the noise at no force",
        typical=0.007,
        null=0.0,
    )

    def apply(self, signal: Noise, rows: Rows) -> Noise:
        load = rows.stiffness * rows.deformation
        sd = jnp.sqrt(signal.sd**2 + (self.share * load) ** 2)
        return Noise(signal.log_weight, sd)


# Added to the fraction so that zero has a logarithm: without effect in double
# precision for readings up to 26 sds out.
_NONE = 1e-150


class Outliers(Effect, stage="noise", family="noise", mixture=True):
    """Contaminated normal: with probability π the noise sd is c times larger.

    A few readings have a much larger error.

    Source: Tukey's contamination model (1960).
    """

    fraction: Scalar = parameter("1", "share of outliers", typical=0.07, null=0.0)
    ratio: Scalar = parameter(
        "1", "noise sd of an outlier over that of an ordinary reading", typical=5.0
    )

    def apply(self, signal: Noise, rows: Rows) -> Noise:
        outlier = jnp.log(self.fraction + _NONE)
        ordinary = jnp.log1p(-self.fraction)
        return Noise(
            jnp.concatenate(
                [signal.log_weight + ordinary, signal.log_weight + outlier]
            ),
            jnp.concatenate([signal.sd, signal.sd * self.ratio]),
        )
