"""The inverse: the deformation that a given force reaches.

A member reaches the first deformation at which it needs this force, so that the share
that gets beyond w is the share that needs less at w. All of it is along the sense of
the force, which need not be the one that the rest of the question has.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from hdcal.exported import jit
from hdcal.prediction.engine.loading_sense import ends_along, sense_of
from hdcal.prediction.engine.mixture import Mixture, quantile_weights
from hdcal.prediction.engine.population_force import PopulationForce, member_mixture
from hdcal.prediction.engine.reading_grid import ReadingGrid
from hdcal.prediction.margin.request import Criteria

# The search ends at this multiple of the tested deformation: what lies beyond rests
# on nothing.
REACH = 2.0
# A deformation is found to this many mm, its share or force to as much [-, N].
_CLOSE, _MOST_STEPS = 1e-11, 64
# Beyond what was tested spreads grow, so that a share may pass and come back again.
_STRETCHES = 64


@dataclass(frozen=True)
class DeformationReached:
    """The deformation that a force reaches; None where none in the range does.

    Attributes:
        force_N: the force.
        temperature_C: of the specimen.
        searched_mm: range of deformation.
        median_mm: of the mean member, middle of its 95 % credible interval.
        lo_mm: lower end.
        hi_mm: upper end.
        lower_bound_mm: of a positive force reached by the share `content`, with the
            stated confidence; of a negative one not passed by it.
        upper_bound_mm: the other one of the two.
        tested: the data hold the whole of it.
    """

    force_N: float
    temperature_C: float
    searched_mm: tuple[float, float]
    median_mm: float | None
    lo_mm: float | None
    hi_mm: float | None
    lower_bound_mm: float | None
    upper_bound_mm: float | None
    tested: bool


def deformation_reached(
    forces: Sequence[PopulationForce],
    given: float,
    criteria: Criteria,
    grid: ReadingGrid,
) -> DeformationReached:
    """Return the deformation at which the members need a force.

    Args:
        forces: of each cause, at the temperature in question.
        given: force [N], with its sign.
        criteria: content and confidence of the bounds.
        grid: of the readings, along the sense of the force.
    """
    where, sense = forces[0].conditions, sense_of(given)
    low, high, warm = map(float, (where.low, where.high, where.temperature))
    # The other way it is searched no farther than was tested.
    far = (1.0, REACH)[::sense]
    ends = min(0.0, far[0] * low), max(0.0, far[1] * high)
    shares = jnp.array([criteria.content, 1.0 - criteria.content])
    size = abs(given), grid.unrounded(abs(given))
    asked = size, shares, ends_along(*ends, sense)
    parts = [_solve(*force.of_sense(sense).traced, *asked) for force in forces]
    found = np.concatenate(parts)
    weights = np.concatenate([force.cause.weights for force in forces])

    def at(column: int, share: float) -> float | None:
        # Draws that never get there count as infinitely far.
        used = quantile_weights(found[:, column], weights, share)
        values = found[used > 0.0, column]
        middle = sense * float(used[used > 0.0] @ values)
        return middle if np.isfinite(values).all() else None

    sure = criteria.confidence
    span, bounds = (at(2, 0.025), at(2, 0.975)), (at(0, 1.0 - sure), at(1, sure))
    (lo, hi), (lower, upper) = (pair[::sense] for pair in (span, bounds))
    numbers = at(2, 0.5), lo, hi, lower, upper
    tested = all(n is not None and low <= n <= high for n in numbers)
    return DeformationReached(given, warm, ends, *numbers, tested)


@jit
def _solve(problem, values, whose, conditions, given, shares, ends):
    """Return deformations [draw, 3]: at both shares and for the mean, [mm].

    Force, ends and what is returned are along the sense of loading; of the force the
    second is what no larger one is read as it.
    """
    import optimistix as optx

    (low, high), sense, (size, unrounded) = ends, conditions.loading, given
    method = optx.Bisection(rtol=0.0, atol=_CLOSE, flip=False)
    places = jnp.linspace(low, high, _STRETCHES + 1)

    def of_draw(value):
        def excess(deformation):
            there = replace(conditions, deformation=sense * deformation)
            parts = member_mixture(problem, value, whose, there)
            mixture = Mixture(*parts).along(sense)
            # Positive where the force does not get this far.
            short = shares - mixture.below(unrounded)
            return jnp.append(short, mixture.centre() - size)

        passed = jax.lax.map(lambda place: excess(place) > 0.0, places)

        def solve(row):
            # What is reached first is reached.
            first = jnp.maximum(jnp.argmax(passed[:, row]), 1)
            lower, upper = places[first - 1], places[first]
            found = optx.root_find(
                lambda place, row: excess(place)[row],
                method,
                0.5 * (lower + upper),
                row,
                options={"lower": lower, "upper": upper},
                max_steps=_MOST_STEPS,
                throw=False,
            ).value
            found = jnp.where(passed[:, row].any(), found, np.inf)
            return jnp.where(passed[0, row], -np.inf, found)

        return jax.vmap(solve)(jnp.arange(3))

    return jax.vmap(of_draw)(values)
