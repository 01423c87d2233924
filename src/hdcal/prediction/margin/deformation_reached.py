"""The inverse: the deformation that a given force reaches.

A member reaches the deformation at which it needs this force, so that the share that
gets beyond w is the share that needs less at w.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from hdcal.prediction.mixture import Mixture, weighted_quantile
from hdcal.prediction.population_force import Outlook, member_mixture

# The search ends at this multiple of the tested deformation: what lies beyond rests
# on nothing.
REACH = 2.0
# Halvings: of a range of a millimetre 2e-12 mm are left.
_HALVINGS = 40


@dataclass(frozen=True)
class Reached:
    """The deformation that a force reaches; None where none in the range does.

    Attributes:
        force_N: the force.
        temperature_C: of the specimen.
        searched_mm: range of deformation.
        median_mm: of the mean member, middle of its 95 % credible interval.
        lo_mm: lower end.
        hi_mm: upper end.
        lower_bound_mm: reached by the share `content`, with the stated confidence.
        upper_bound_mm: not passed by that share, with that confidence.
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


def search_range(low: float, high: float) -> tuple[float, float]:
    """Return where a deformation is looked for, given the tested ones [mm]."""
    return min(0.0, REACH * low), max(0.0, REACH * high)


def reach(
    outlooks: Sequence[tuple[float, Outlook]],
    force: float,
    temperature: float,
    content: float,
    confidence: float,
) -> Reached:
    """Return the deformation at which the members need a force.

    Args:
        outlooks: of each model, with its probability.
        force: given [N].
        temperature: of the specimen [°C].
        content: share of the population within each bound.
        confidence: of each bound.
    """
    question = outlooks[0][1].question
    low, high = float(question.low), float(question.high)
    ends = search_range(low, high)
    parts, weights = [], []
    for share, outlook in outlooks:
        shares = jnp.array([content, 1.0 - content])
        parts.append(np.asarray(_solve(outlook, force, temperature, shares, ends)))
        size = len(parts[-1])
        weights.append(np.full(size, share / size))
    found, weight = np.concatenate(parts), np.concatenate(weights)

    def at(column: int, share: float) -> float | None:
        # Draws that never get there count as infinitely far.
        value, used = weighted_quantile(found[:, column], weight, share)
        whole = np.isfinite(found[used > 0.0, column]).all()
        return float(value) if whole else None

    numbers = at(2, 0.5), at(2, 0.025), at(2, 0.975)
    bounds = at(0, 1.0 - confidence), at(1, confidence)
    tested = all(n is not None and low <= n <= high for n in (*numbers, *bounds))
    return Reached(force, temperature, ends, *numbers, *bounds, tested)


def _solve(outlook: Outlook, force, temperature, shares, ends):
    return _solve_all(
        outlook.posterior.problem,
        dict(outlook.values),
        outlook.question,
        jnp.asarray(temperature, float),
        outlook.nodes,
        jnp.asarray(force, float),
        shares,
        jnp.asarray(ends),
        population=outlook.population,
        quantity=outlook.quantity,
        rounded=outlook.rounded,
    )


@partial(jax.jit, static_argnames=("population", "quantity", "rounded"))
def _solve_all(
    problem,
    values,
    question,
    temperature,
    nodes,
    force,
    shares,
    ends,
    *,
    population,
    quantity,
    rounded,
):
    """Return deformations [draw, 3]: at both shares and for the mean, [mm]."""

    def one(value):
        def excess(deformation, row):
            parts = member_mixture(
                problem,
                value,
                question=question.at(deformation),
                temperature=temperature,
                scale=jnp.ones(()),
                nodes=nodes,
                population=population,
                quantity=quantity,
            )
            step = problem.step if rounded else 0.0
            mixture = Mixture(*parts, step, rounded)
            # Positive where the force does not get this far.
            short = shares[jnp.minimum(row, 1)] - mixture.below(force)
            return jnp.where(row == 2, mixture.centre() - force, short)

        def solve(row):
            def halve(_, ends):
                low, high = ends
                middle = 0.5 * (low + high)
                far = excess(middle, row) > 0.0
                return jnp.where(far, low, middle), jnp.where(far, middle, high)

            low, high = jax.lax.fori_loop(0, _HALVINGS, halve, (ends[0], ends[1]))
            found = 0.5 * (low + high)
            found = jnp.where(excess(ends[1], row) <= 0.0, np.inf, found)
            return jnp.where(excess(ends[0], row) > 0.0, -np.inf, found)

        return jax.vmap(solve)(jnp.arange(3))

    return jax.vmap(one)(values)
