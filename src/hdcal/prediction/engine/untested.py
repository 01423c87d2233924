"""What untested conditions may add to a force: unknown, so one place of it a draw.

Nothing of it is scatter: beyond the tested deformation a bend may grow, beyond the
tested temperatures the rig may drift, for every member alike.
"""

from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.special import ndtri

from hdcal.data.full_scale import REFERENCE
from hdcal.data.priors import effect_priors
from hdcal.data.records import Array
from hdcal.exported import jit
from hdcal.inference.discrepancy import Discrepancy
from hdcal.inference.distributions import moments
from hdcal.inference.problem import Problem
from hdcal.inference.values import Values
from hdcal.physics.effects.temperature import ThermalExpansion, ThermalZeroDrift
from hdcal.prediction.engine.causes import Cause
from hdcal.prediction.engine.even_points import spread_evenly
from hdcal.prediction.engine.growth import BendLaw, Growth, fit_growths

# Sites of a draw beside those of the posterior: size of the bend and its noise beyond
# each end, and standard normal scores of the bend, the zero and the frame.
BENDS, PLACES = "_bends", "_places"
# Numbers of a draw that they are made of.
SITES = 4


class Untested(eqx.Module):
    """What is not known of conditions beyond the tested ones.

    Attributes:
        below: the bend beyond the low end of the tested deformation.
        above: and beyond the high one.
        coldest: tested temperature [°C].
        warmest: likewise.
        zero: mean and sd of the zero's drift with temperature [N/K].
        frame: mean and sd of the radial deformation that the frame gains [mm/K].
    """

    below: Growth
    above: Growth
    coldest: Float[Array, ""] | float
    warmest: Float[Array, ""] | float
    zero: tuple[float, float]
    frame: tuple[float, float]

    def kelvins(self, temperature):
        """Return how far temperatures lie outside the tested ones, with sign [K]."""
        return _outside(temperature, self.coldest, self.warmest)

    def drift(self, value: Values, temperature, loading):
        """Return shifts of the force's zero [N] and of the deformation, radial [mm].

        Args:
            value: one draw, with its scores.
            temperature: of the specimen [°C].
            loading: sense of loading, along which the scores are.
        """
        _, zero, frame = value[PLACES]
        kelvins = self.kelvins(temperature)
        return tuple(
            (mean + sd * loading * score) * kelvins
            for (mean, sd), score in ((self.zero, zero), (self.frame, frame))
        )

    def bends(self, value: Values) -> "Bends":
        """Return what may bend the force of one draw, which has its scores."""
        below, above = value[BENDS]
        return Bends(
            self.below.of_size(*below), self.above.of_size(*above), value[PLACES][0]
        )


class Bends(eqx.Module):
    """What may bend the force of one draw: computed once for all deformations.

    Attributes:
        below: the bend beyond the low end of the tested deformation.
        above: and beyond the high one.
        score: place of the draw in both, a standard normal score.
    """

    below: BendLaw
    above: BendLaw
    score: Float[Array, ""] | float

    def law(self, deformation):
        """Return mean and sd of the bend [N], and how much of it is in [-]; each (n,).

        Args:
            deformation: as read [mm], shape (n,).
        """
        over = jnp.asarray(deformation) > self.above.growth.far
        sides = self.above.at(deformation), self.below.at(deformation)
        return tuple(jnp.where(over, *pair) for pair in zip(*sides, strict=True))

    def leftover(self, problem: Problem, value: Values, deformation, loading, movement):
        """Return the bend and the fitted leftover discrepancy of a draw [N], (n,) each.

        The bend has no part in what was tested, and the fit none in what is far from
        it; without a fit that is zero.

        Args:
            problem: structure.
            value: the same draw.
            deformation: as read [mm], shape (n,).
            loading: sense of loading, along which the score is.
            movement: +1 where the deformation rises, −1 where it falls, shape (n,).
        """
        mean, sd, share = self.law(deformation)
        bend = share * (mean + sd * loading * self.score)
        if problem.discrepancy is None or "gap_weights" not in value:
            return bend, jnp.zeros_like(bend)
        ends = self.above.growth.far, self.below.growth.far
        place = deformation, movement
        columns = fitted_columns(problem.discrepancy, ends, place, share)
        return bend, columns @ value["gap_weights"]


@jit
def _outside(temperature, coldest, warmest):
    return temperature - jnp.clip(temperature, coldest, warmest)


def fitted_columns(
    discrepancy: Discrepancy, ends: tuple, place: tuple, share
) -> Float[Array, "n m"]:
    """Return what each weight of the fitted leftover discrepancy adds to readings [-].

    Args:
        discrepancy: of the problem.
        ends: of the tested deformation [mm].
        place: deformation as read [mm], and +1 where it rises or −1 where it falls,
            each of shape (n,).
        share: how much of the bend is in, from `Bends.law`, shape (n,).
    """
    deformation, movement = place
    columns = discrepancy.columns(jnp.clip(deformation, *ends), movement)
    return (1.0 - share)[:, None] * columns


def with_untested(cause: Cause, seed: int) -> tuple[Values, Untested]:
    """Return all draws of a cause with what they leave open, and what that is.

    Args:
        cause: from `causes_of`.
        seed: of what they leave open.
    """
    untested, sites = untested_of(cause, spread_evenly(cause.size, SITES, seed))
    return {**cause.values, **sites}, untested


def untested_of(cause: Cause, levels: np.ndarray) -> tuple[Untested, dict]:
    """Return what a cause leaves open, and the sites that its draws get.

    Args:
        cause: from `causes_of`.
        levels: from `spread_evenly`, (draw, SITES).
    """
    records = cause.posterior.case.records
    below, above = fit_growths(cause)
    known = {effect.name for effect in cause.posterior.effects}
    gear = cause.posterior.case.gear
    # A frame expands by its own length, however short the stroke.
    stroke = max(gear.full_scale.deformation, REFERENCE.deformation)
    scale = replace(gear.full_scale, deformation=stroke)
    priors = {**effect_priors(scale), **gear.effect_priors}
    zero, frame = (
        (0.0, 0.0) if effect.name in known else moments(priors[f"{effect.name}.slope"])
        for effect in (ThermalZeroDrift, ThermalExpansion)
    )
    warm = records.temperature
    untested = Untested(
        below.growth, above.growth, float(warm.min()), float(warm.max()), zero, frame
    )
    sizes = np.stack([side.drawn(levels[:, 0]) for side in (below, above)], axis=1)
    return untested, {BENDS: sizes, PLACES: ndtri(levels[:, 1:])}
