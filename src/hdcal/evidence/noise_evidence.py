"""Evidence of effects on the noise's shape: Laplace over base and noise sd.

The mean is linear and the noise any mixture of normals, so that the posterior of
the base's coefficients and log σ is close to normal; for plain normal noise it is
exact but for σ.
"""

from dataclasses import dataclass
from functools import cached_property, partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from hdcal.data.priors import Prior
from hdcal.data.records import Array
from hdcal.evidence.effect_curves import padded_records
from hdcal.evidence.parameter_grid import quantile_grid
from hdcal.evidence.prepare import PreparedCase
from hdcal.exported import jit
from hdcal.inference.distributions import distribution
from hdcal.inference.likelihood import log_probability, row_precision
from hdcal.inference.padding import append_zeros, bucket_size, measured, repeat_last_row
from hdcal.physics.effect import Effect, Noise, Rows, parameters

_AMPLITUDES, _SHAPES = 10, 3
_STEPS = 40
# Newton steps below this, in prior sds and log σ, change no evidence.
_STILL = 1e-7
# A step that leads higher is tried again, so much shorter.
_SHORTER = 0.3
# Digits of −log density that are more than rounding.
_DIGITS = 8
# Curvatures below this, some of the prior's own, are taken as this: a search that ends
# beside a mode, where there is next to none, would seem to have found a huge volume.
_LEAST_CURVATURE = 0.3


@dataclass(frozen=True)
class NoiseEvidence:
    """One effect on the noise, which XLA goes on to weigh until something is asked.

    Attributes:
        values: of the amplitude at each point, the last one that of plain noise.
        at_points: log evidence at each point.
        precision: effective precision of each row at each point [1/N²], and padding.
        rows: that were measured.
    """

    values: Float[np.ndarray, " k"]
    at_points: Float[Array, " k"]
    precision: Float[Array, "k p"]
    rows: int

    @cached_property
    def log_factor(self) -> float:
        """Log evidence less that of plain noise, both at no correlation."""
        *found, plain = np.asarray(self.at_points)
        return float(np.logaddexp.reduce(found) - np.log(len(found)) - plain)

    @cached_property
    def relative_sd(self) -> Float[np.ndarray, " n"]:
        """Effective noise sd of each row, relative to its mean."""
        precision = np.asarray(self.precision)[:-1, : self.rows]
        relative = 1.0 / np.sqrt(self._weight @ precision)
        return relative / np.exp(np.mean(np.log(relative)))

    @cached_property
    def amplitude(self) -> tuple[float, float, float]:
        """Posterior quantiles .025, .5 and .975 of the amplitude."""
        return weighted_quantiles(self.values[:-1], self._weight)

    @cached_property
    def _weight(self) -> np.ndarray:
        found = np.asarray(self.at_points)[:-1]
        return np.exp(found - np.logaddexp.reduce(found))


class NoiseProblem(eqx.Module):
    """Rows with a linear mean and noise of any shape, padded to a shared length.

    Attributes:
        rows: what an effect on the noise may look at.
        reading: less the prior mean of the base model [N]; 0 in padding.
        columns: of base model and a curve beside it [N]; 0 in padding.
        known_sd: measurement sd that is known of each row [N].
        precision: prior precision of the coefficients.
        count: rows that were measured.
    """

    rows: Rows
    reading: Float[Array, " n"]
    columns: Float[Array, "n k"]
    known_sd: Float[Array, " n"]
    precision: Float[Array, " k"]
    count: int | Array


def _noise_of(effect: Effect, problem: NoiseProblem, log_sd) -> Noise:
    sd = jnp.sqrt(jnp.exp(2.0 * log_sd) + problem.known_sd**2)
    noise = Noise(jnp.zeros(1), jnp.broadcast_to(sd, (1, *problem.reading.shape)))
    return effect.apply(noise, problem.rows)


def _minus_log_density(point, effect, problem: NoiseProblem, sigma: Prior):
    """Return −log p(reading, coefficients, log σ) but for a constant."""
    coefficients, log_sd = point[:-1], point[-1]
    noise = _noise_of(effect, problem, log_sd)
    mean = problem.columns @ coefficients
    each = log_probability(problem.reading, mean, noise, 0.0, rounded=False)
    inside = measured(len(problem.reading), problem.count)
    law = distribution(sigma, "sigma").log_prob(jnp.exp(log_sd)) + log_sd
    prior = -0.5 * jnp.sum(problem.precision * coefficients**2)
    return -(jnp.sum(jnp.where(inside, each, 0.0)) + law + prior)


def _row_precision(point, effect, problem: NoiseProblem):
    """Return the effective precision of each row at a point [1/N²]."""
    noise = _noise_of(effect, problem, point[-1])
    error = problem.reading - problem.columns @ point[:-1]
    return row_precision(error, noise)


@jit
@partial(jax.vmap, in_axes=(0, None, None, None))
def _laplace(effect: Effect, problem: NoiseProblem, sigma: Prior, start):
    """Return log evidence and effective precision of each row, of each effect."""

    @jax.jit
    def minus(point):
        return _minus_log_density(point, effect, problem, sigma)

    def slope_of(point):
        height, slope = jax.value_and_grad(minus)(point)
        return slope, (height, slope)

    def look(point):
        """Return height, Newton's move and log determinant at a point."""
        hessian, (height, slope) = jax.jacfwd(slope_of, has_aux=True)(point)
        strength, axes = jnp.linalg.eigh(hessian)
        log_det = jnp.sum(jnp.log(jnp.maximum(strength, _LEAST_CURVATURE)))
        move = axes @ (
            (axes.T @ slope) / jnp.maximum(jnp.abs(strength), _LEAST_CURVATURE)
        )
        return height, move, log_det

    def step(state):
        count, share, *here = state
        point, height, move, _ = here
        there = point - share * move
        there = (there, *look(there))
        # What rounding decides counts as lower: near the mode full steps converge.
        lower = jnp.round(there[1], _DIGITS) <= jnp.round(height, _DIGITS)
        here = [jnp.where(lower, *both) for both in zip(there, here, strict=True)]
        return count + 1, jnp.where(lower, 1.0, _SHORTER * share), *here

    def goes_on(state):
        count, moves = state[0], jnp.max(jnp.abs(state[4])) > _STILL
        return (count == 0) | ((count < _STEPS) & moves)

    # The first step looks where it begins.
    begin = 0, 1.0, start, jnp.inf, jnp.zeros_like(start), 0.0
    *_, best, height, _, log_det = jax.lax.while_loop(goes_on, step, begin)
    evidence = (
        -height
        + 0.5 * jnp.sum(jnp.log(problem.precision))
        + 0.5 * jnp.log(2.0 * jnp.pi)
        - 0.5 * log_det
    )
    return evidence, _row_precision(best, effect, problem)


def _noise_problem(
    case: PreparedCase, beside: Float[np.ndarray, " n"] | None
) -> NoiseProblem:
    """Return the rows; a curve beside the base is free by its own size."""
    base, records, rows = case.base, case.records, case.rows
    padded = padded_records(records)
    rise = np.asarray(padded.temperature) - case.reading.reference_temperature
    stiffness = base.stiffness * (1.0 - base.alpha * rise)
    radial = (
        np.asarray(padded.deformation) - base.deformation_offset
    ) * case.reading.radial_per_read
    curve = np.zeros(len(rows.reading)) if beside is None else beside
    size = bucket_size(len(rows.reading))
    return NoiseProblem(
        Rows(padded, rise, stiffness, radial),
        append_zeros(rows.reading - curve, size),
        append_zeros(np.column_stack([rows.base, curve]), size),
        repeat_last_row(np.asarray(records.force_sd), size),
        # The prior of the coefficients themselves, free of the noise.
        np.append(rows.precision / case.noise_sd**2, 1.0),
        len(rows.reading),
    )


def noise_evidence(
    effect: type[Effect],
    case: PreparedCase,
    beside: Float[np.ndarray, " n"] | None = None,
) -> NoiseEvidence:
    """Compute the evidence of an effect on the noise against plain noise.

    Args:
        effect: of the noise stage.
        case: whose noise it shapes.
        beside: what another effect adds to the mean [N], shape (n,).
    """
    values, amplitude = _grid(effect, case)
    sigma, problem = case.priors["sigma"], _noise_problem(case, beside)
    start = _least_squares(problem, case.noise_sd)
    at_points, precision = _laplace(effect(**values), problem, sigma, start)
    rows = len(case.rows.reading)
    return NoiseEvidence(values[amplitude], at_points, precision, rows)


def _grid(
    effect: type[Effect], case: PreparedCase
) -> tuple[dict[str, np.ndarray], str]:
    """Return values of every parameter at all points, and the amplitude's name.

    A last point follows at which the amplitude is null: the noise is plain there.
    """
    declared = parameters(effect)
    amplitude = next(n for n, about in declared.items() if about.null is not None)
    priors = {name: case.priors[f"{effect.name}.{name}"] for name in declared}
    counts = {
        name: _SHAPES if about.null is None else _AMPLITUDES
        for name, about in declared.items()
    }
    values = {}
    for name, column in quantile_grid(priors, counts).items():
        null = declared[name].null
        values[name] = np.append(column, column[0] if null is None else null)
    return values, amplitude


def _least_squares(problem: NoiseProblem, noise_sd: float) -> np.ndarray:
    """Return coefficients and log noise sd, where the search starts."""
    columns, reading = np.asarray(problem.columns), np.asarray(problem.reading)
    pull = np.diag(np.sqrt(problem.precision) * noise_sd)
    stacked = np.vstack([columns, pull]), np.append(reading, np.zeros(len(pull)))
    solved = np.linalg.lstsq(*stacked, rcond=None)[0]
    squares = np.sum((reading - columns @ solved) ** 2) / problem.count
    return np.append(solved, 0.5 * np.log(squares))


def weighted_quantiles(values, weight) -> tuple[float, float, float]:
    """Return the quantiles .025, .5 and .975 of a weighted sample."""
    order = np.argsort(values)
    place = np.cumsum(weight[order]) - 0.5 * weight[order]
    low, middle, high = np.interp(
        (0.025, 0.5, 0.975), place / weight.sum(), values[order]
    )
    return float(low), float(middle), float(high)
