"""The forces of the members of a population, as each draw of a cause expects them.

Given the parameters of one draw, the force of one future member is a mixture of
normals. What is not known but the same for every member (parameters, the centre of
the population, the leftover discrepancy) is a matter of the draw and never scatter.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from scipy.special import ndtri

from hdcal.exported import jit
from hdcal.inference.gauges import acting, shown
from hdcal.inference.problem import Problem
from hdcal.inference.values import Values
from hdcal.prediction.engine.causes import Cause
from hdcal.prediction.engine.conditions import (
    Conditions,
    Direction,
    usual_sd,
    usual_temperature,
)
from hdcal.prediction.engine.even_points import spread_evenly
from hdcal.prediction.engine.forces import Quantity, force_of, grid_records
from hdcal.prediction.engine.loading_sense import (
    LoadingSense,
    loading_sense,
    sense_of,
)
from hdcal.prediction.engine.mixture import Mixture
from hdcal.prediction.engine.population import Population, Whose
from hdcal.prediction.engine.sizes import tolerance_strata
from hdcal.prediction.engine.untested import (
    SITES,
    Untested,
    untested_of,
)

# More draws than this change no digit that is printed.
MOST_DRAWS = 8000
# Where effects bend the force, a specimen's deviation is split: this share of its sd
# goes to nodes, the rest is narrow enough to go along the tangent.
_AT_NODES, _SPLIT = 0.8, 7
# Standard normal scores of each draw: of the population's centre of gears and of
# mountings.
SCORES = "_scores"


@dataclass(frozen=True)
class PopulationForce:
    """The forces of a population, as one cause expects them.

    Attributes:
        cause: with what each draw holds for true of the whole population.
        whose: force it is.
        conditions: under which.
        tolerances: ± of the sizes by field of the geometry [mm].
    """

    cause: Cause
    whose: Whose
    conditions: Conditions
    tolerances: Mapping[str, float]

    def at(self, temperature: float) -> "PopulationForce":
        """Return the forces at another temperature [°C]."""
        warm = replace(self.conditions, temperature=np.asarray(temperature, float))
        return replace(self, conditions=warm)

    def of_sense(self, sense: LoadingSense) -> "PopulationForce":
        """Return the forces of a gear that is loaded in a sense."""
        return replace(self, conditions=replace(self.conditions, loading=float(sense)))

    @property
    def traced(self) -> tuple[Problem, Values, Whose, Conditions]:
        """What compiled functions are given: structure, draws, whose and where."""
        return self.cause.problem, self.cause.values, self.whose, self.conditions

    def mixture(self) -> Mixture:
        """Return the mixture of every draw [draw, component], before rounding."""
        return mixtures(*self.traced)

    @property
    def rounding_sd(self) -> float:
        """Sd that the steps of a reading add to it, wherever it lies in one [N]."""
        step = float(self.cause.problem.step) if self.whose.rounded else 0.0
        return step / 12.0**0.5

    @property
    def sense(self) -> LoadingSense:
        """Sense of loading."""
        return sense_of(float(self.conditions.loading))


def population_force(
    cause: Cause,
    deformation: float,
    population: Population,
    *,
    quantity: Quantity = "reading",
    direction: Direction = "up",
    sense: LoadingSense | None = None,
    tolerances: Mapping[str, float] | None = None,
    seed: int = 0,
) -> PopulationForce:
    """Return the forces of a population under one cause.

    Args:
        cause: from `causes_of`.
        deformation: as read [mm].
        population: whose force; see `check_population`.
        quantity: which force.
        direction: up to load, down to unload.
        sense: of loading; by default the one that this cause sees.
        tolerances: ± by field of the geometry [mm].
        seed: of what the data leave open about the centre of the population.
    """
    case, records = cause.posterior.case, cause.posterior.case.records
    values, untested = _with_scores(cause, seed)
    widths = dict(tolerances or {})
    rounded = quantity == "reading" and float(cause.problem.step) > 0.0
    return PopulationForce(
        replace(cause, values=values),
        Whose(population, quantity, rounded),
        Conditions(
            deformation=float(deformation),
            temperature=usual_temperature(case),
            known_sd=usual_sd(records),
            untested=untested,
            scale=1.0,
            strata=tolerance_strata(case.gear.geometry, widths, cause.posterior.theory),
            loading=float(sense or loading_sense([cause], deformation)),
            down=direction == "down",
        ),
        widths,
    )


def _with_scores(cause: Cause, seed: int) -> tuple[dict[str, np.ndarray], Untested]:
    """Return draws, thinned where they are many, with what the data leave open."""
    kept = np.linspace(0, cause.size - 1, min(cause.size, MOST_DRAWS))
    kept = kept.round().astype(int)
    values = {name: column[kept] for name, column in cause.values.items()}
    levels = spread_evenly(len(kept), 2 + SITES, seed)
    untested, open_sites = untested_of(cause, levels[:, 2:])
    return {**values, SCORES: ndtri(levels[:, :2]), **open_sites}, untested


@jit
def mixtures(
    problem: Problem, values: Values, whose: Whose, conditions: Conditions
) -> Mixture:
    """Return the forces of future members for every draw, shape [draw, component]."""

    def one(value):
        return member_mixture(problem, value, whose, conditions)

    weight, mean, sd = jax.vmap(one)(values)
    return Mixture(weight, mean, sd)


def member_mixture(
    problem: Problem, value: Values, whose: Whose, conditions: Conditions
):
    """Return weight, mean and sd of the components of one draw.

    Tested deviations are from the mean of the tested members. The population's own
    centre lies sd/√n from it, known to nobody: one place of it in each draw.
    """
    gears, mountings = whose.tested_gears(problem), whose.tested_mountings(problem)
    strata = conditions.strata
    own = value["specimen_sd"] if gears else 0.0
    centre = own * value[SCORES][0] / np.sqrt(max(gears, 1))
    place, share, tangent = _split(bool(gears and problem.effects))
    base = conditions.scale * strata.factor[:, None]
    factor = base * (1.0 + centre + own * place)
    within = factor * (strata.width / strata.factor)[:, None]
    width2 = ((base * own * tangent) ** 2 + within**2).ravel()

    def at(factor):
        return member_force(problem, value, whose.quantity, conditions, factor)

    one = jnp.ones(())
    mean, slope, (log_weight, noise) = jax.vmap(
        lambda f: jax.jvp(at, (f,), (one,), has_aux=True)
    )(factor.ravel())
    zero = value["run_offset_sd"] if mountings else 0.0
    # What is drawn about zero is drawn along the sense of loading.
    score = conditions.loading * value[SCORES][1]
    shift = zero * score / np.sqrt(max(mountings, 1))
    shift = shift + leftover(problem, value, whose.quantity, conditions)
    variance = noise**2 + zero**2 + (slope**2 * width2)[:, None]
    # The root of zero has no derivative.
    spread = jnp.sqrt(variance + 1e-24)
    weight = (strata.weight[:, None] * share).reshape(-1, 1) * jnp.exp(log_weight)
    mean = jnp.broadcast_to((mean + shift)[:, None], spread.shape)
    return weight.ravel(), mean.ravel(), spread.ravel()


def _split(bent: bool):
    """Return nodes and weights of a standard normal, and the sd that is left over."""
    if not bent:
        return np.zeros(1), np.ones(1), 1.0
    place, share = np.polynomial.hermite_e.hermegauss(_SPLIT)
    return _AT_NODES * place, share / share.sum(), np.sqrt(1.0 - _AT_NODES**2)


def member_force(
    problem: Problem, value: Values, quantity: Quantity, conditions: Conditions, factor
):
    """Return the mean force of one member, and weights and sds of its noise."""
    along, sense = [conditions.deformation], [conditions.movement]
    if conditions.down:
        along = [conditions.turn, conditions.deformation]
        sense = [conditions.loading, conditions.movement]
    path, way = (
        jnp.stack([jnp.asarray(each, float) for each in column])
        for column in (along, sense)
    )
    warmth = jnp.full(len(along), conditions.temperature)
    one_gear = np.zeros(len(along), dtype=int)
    records = grid_records(path, warmth, way, conditions.known_sd, one_gear)
    zero = moved = 0.0
    if quantity == "reading":
        zero, moved = conditions.untested.drift(
            value, conditions.temperature, conditions.loading
        )
    mean, noise = force_of(
        problem,
        value,
        records,
        factor=factor,
        zero=zero,
        moved=moved,
        quantity=quantity,
    )
    if quantity == "load":
        return mean[-1], (jnp.zeros(1), jnp.zeros(1))
    return mean[-1], (noise.log_weight, noise.sd[:, -1])


def bend_law(force: PopulationForce) -> tuple[float, float]:
    """Return mean and sd of the bend that untested deformation may bring [N]."""
    values, where = force.cause.values, force.conditions
    mean, sd = map(np.asarray, _bends(where.untested, values, where.deformation))
    return float(np.mean(mean)), float(np.sqrt(np.mean(sd**2) + np.var(mean)))


@jit
def _bends(untested: Untested, values: Values, deformation):
    """Return mean and sd of the bend of each draw [N]."""
    at = jnp.reshape(deformation, 1)

    def one(value):
        mean, sd, share = untested.bends(value).law(at)
        return share * mean, share * sd

    return jax.vmap(one)(values)


def leftover(
    problem: Problem, value: Values, quantity: Quantity, conditions: Conditions
):
    """Return the leftover discrepancy of one draw at the deformation asked for [N]."""
    at = jnp.reshape(jnp.asarray(conditions.deformation, float), 1)
    if quantity == "load":
        at, _ = shown(value, at, 0.0)
    bends = conditions.untested.bends(value)
    movement = jnp.reshape(jnp.asarray(conditions.movement, float), 1)
    bend, fitted = bends.leftover(problem, value, at, conditions.loading, movement)
    left = (bend + fitted)[0]
    return acting(value, left) if quantity == "load" else left
