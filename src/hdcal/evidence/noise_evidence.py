"""Evidence of effects on the noise's shape: Laplace over base and noise sd.

The mean is linear and the noise any mixture of normals, so that the posterior of
the base's coefficients and log σ is close to normal; for plain normal noise it is
exact but for σ.
"""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.evidence.prepare import Setting
from hdcal.inference.distributions import distribution, frozen
from hdcal.inference.likelihood import log_probability
from hdcal.physics.effect import Effect, Noise, Rows, parameters

_AMPLITUDES, _SHAPES = 10, 3
_STEPS = 15
# Readings are written at least this much finer than their noise, or else on purpose.
_WRITTEN = 20.0
# Steps below this share of the noise do no harm and leave no trace.
_LEAST_STEP = 0.2
# Rounding to a step scatters by step/√12: a coarser one is of forces that were set,
# not read, and its multiples say nothing of the instrument.
_MOST_STEP = 1.5 * np.sqrt(12.0)
# Steps are at least this many of the last digit; the line through counts settles soon.
_APART, _REFINEMENTS = 20.0, 6


@dataclass(frozen=True)
class NoiseEvidence:
    """One effect on the noise.

    Attributes:
        log_factor: log evidence less that without it, both at no correlation.
        relative_sd: effective noise sd of each row, relative to its mean.
        amplitude: posterior quantiles .05, .5, .95 of the amplitude.
    """

    log_factor: float
    relative_sd: Float[Array, " n"]
    amplitude: tuple[float, float, float]


@partial(jax.jit, static_argnames=("effect", "names"))
def _laplace(effect, names, values, setting_parts, sigma, start):
    """Return log evidence and effective relative precision at each point."""
    force_rows, reading, base, known, precision = setting_parts
    width = base.shape[1]

    def noise_of(row, log_sd):
        sd = jnp.sqrt(jnp.exp(2.0 * log_sd) + known**2)
        noise = Noise(jnp.zeros(1), jnp.broadcast_to(sd, (1, *reading.shape)))
        if effect is None:
            return noise
        made = effect(**dict(zip(names, row, strict=True)))
        return made.apply(noise, force_rows)

    def one(row):
        def minus(point):
            coefficients, log_sd = point[:width], point[width]
            noise = noise_of(row, log_sd)
            each = log_probability(
                reading, base @ coefficients, noise, 0.0, rounded=False
            )
            law = distribution(sigma).log_prob(jnp.exp(log_sd)) + log_sd
            # A pull on σ alone: coefficients have unit normal priors.
            prior = -0.5 * jnp.sum(precision * coefficients**2)
            return -(jnp.sum(each) + law + prior)

        def step(point, _):
            slope, curve = jax.grad(minus)(point), jax.hessian(minus)(point)
            strength, axes = jnp.linalg.eigh(curve)
            move = axes @ ((axes.T @ slope) / jnp.maximum(jnp.abs(strength), 1e-6))
            tries = jnp.stack([point - move * s for s in (1.0, 0.3, 0.1, 0.0)])
            heights = jax.vmap(minus)(tries)
            heights = jnp.where(jnp.isfinite(heights), heights, jnp.inf)
            return tries[jnp.argmin(heights)], None

        best, _ = jax.lax.scan(step, start, None, length=_STEPS)
        strength = jnp.linalg.eigvalsh(jax.hessian(minus)(best))
        log_det = jnp.sum(jnp.log(jnp.maximum(strength, 1e-6)))
        evidence = (
            -minus(best)
            + 0.5 * jnp.sum(jnp.log(precision))
            + 0.5 * jnp.log(2.0 * jnp.pi)
            - 0.5 * log_det
        )
        noise = noise_of(row, best[width])
        error = reading - base @ best[:width]
        share = jax.nn.softmax(
            noise.log_weight[:, None]
            - 0.5 * (error / noise.sd) ** 2
            - jnp.log(noise.sd),
            axis=0,
        )
        return evidence, jnp.sum(share / noise.sd**2, axis=0)

    return jax.vmap(one)(values)


def _parts(setting: Setting, beside: Float[Array, " n"] | None):
    """Return what `_laplace` needs; a curve beside the base is free by its own size."""
    base, records, rows = setting.base, setting.records, setting.rows
    rise = np.asarray(records.temperature) - setting.reading.reference_temperature
    stiffness = base.stiffness * (1.0 - base.alpha * rise)
    radial = (
        np.asarray(records.deformation) - base.deformation_offset
    ) * setting.reading.radial_per_read
    curve = np.zeros(len(rise)) if beside is None else beside
    # The prior of the coefficients themselves, free of the noise.
    precision = np.asarray(rows.precision) / setting.noise_sd**2
    return (
        Rows(records, rise, stiffness, radial),
        rows.reading - curve,
        np.column_stack([rows.base, curve]),
        np.asarray(records.force_sd),
        np.append(precision, 1.0),
    )


def assess_noise(
    effect: type[Effect], setting: Setting, beside: Float[Array, " n"] | None = None
) -> NoiseEvidence:
    """Compute the evidence of an effect on the noise against plain noise.

    Args:
        effect: of the noise stage.
        setting: the case.
        beside: what another effect adds to the mean [N], shape (n,).
    """
    declared = parameters(effect)
    names, axes = tuple(declared), []
    for name, about in declared.items():
        prior = setting.priors[f"{effect.name}.{name}"]
        count = _SHAPES if about.null is None else _AMPLITUDES
        quantiles = (np.arange(count) + 0.5) / count
        fixed = prior.family == "fixed"
        axes.append(prior.numbers[:1] if fixed else frozen(prior).ppf(quantiles))
    mesh = np.meshgrid(*map(np.asarray, axes), indexing="ij")
    values = np.stack([m.ravel() for m in mesh], axis=1).astype(float)
    sigma = setting.priors["sigma"]
    parts = _parts(setting, beside)
    start = _least_squares(*parts[1:3], parts[4] * setting.noise_sd**2)
    found, precision = _laplace(effect, names, values, parts, sigma, start)
    plain, _ = _laplace(None, (), np.zeros((1, 0)), parts, sigma, start)
    found = np.asarray(found)
    weight = np.exp(found - np.logaddexp.reduce(found))
    mean_precision = weight @ np.asarray(precision)
    relative = 1.0 / np.sqrt(mean_precision)
    amplitude = next(i for i, n in enumerate(names) if declared[n].null is not None)
    return NoiseEvidence(
        float(np.logaddexp.reduce(found) - np.log(len(found)) - np.asarray(plain)[0]),
        relative / np.exp(np.mean(np.log(relative))),
        weighted_quantiles(values[:, amplitude], weight),
    )


def _least_squares(reading, base, precision) -> np.ndarray:
    """Return coefficients and log noise sd, where the search starts."""
    solved = np.linalg.solve(base.T @ base + np.diag(precision), base.T @ reading)
    left = reading - base @ solved
    return np.append(solved, 0.5 * np.log(np.mean(left**2)))


def weighted_quantiles(values, weight) -> tuple[float, float, float]:
    """Return the quantiles .05, .5 and .95 of a weighted sample."""
    order = np.argsort(values)
    place = np.cumsum(weight[order]) - 0.5 * weight[order]
    low, middle, high = np.interp(
        (0.05, 0.5, 0.95), place / weight.sum(), values[order]
    )
    return float(low), float(middle), float(high)


def lattice_step(readings: np.ndarray, noise_sd: float) -> tuple[float, float]:
    """Return the step on which all readings lie, and the step they are written in.

    Args:
        readings: force as read [N], shape (n,).
        noise_sd: of a reading [N].

    Returns:
        Largest step between readings, all of which lie on a grid of it, and the
        finest one that they can show [N]; the first is 0 when it is none above.
    """
    finest = noise_sd / _WRITTEN
    counted = _counted_step(np.asarray(readings, float))
    if counted > finest:
        return counted, finest
    digits = int(np.clip(np.ceil(-np.log10(noise_sd)) + 4, 0, 9))
    whole = np.round(np.asarray(readings) * 10.0**digits).astype(np.int64)
    step = np.gcd.reduce(np.abs(whole)) / 10.0**digits
    return (float(step), finest) if step > finest else (0.0, finest)


def _counted_step(readings: np.ndarray) -> float:
    """Return the step of counts that were scaled and then written with few digits.

    Zero and step are those of the line through the counts; every reading lies on it
    as closely as it was written down. 0 where there is no such step.
    """
    values = np.unique(readings)
    written = next(
        (10.0**-d for d in range(10) if np.array_equal(np.round(values, d), values)),
        0.0,
    )
    gaps = np.diff(values)
    gaps = gaps[gaps > _APART * written]
    if written == 0.0 or len(gaps) < 2:
        return 0.0
    step, zero = float(gaps.min()), 0.0
    for _ in range(_REFINEMENTS):
        counts = np.round((values - values[0]) / step)
        if counts[-1] < 2.0:
            return 0.0
        step, zero = np.polyfit(counts, values, 1)
    off = np.max(np.abs(values - zero - step * np.round((values - zero) / step)))
    return float(step) if off <= written and step > _APART * written else 0.0


def lattice_evidence(setting: Setting, sd: float) -> tuple[float, float]:
    """Return the log evidence of readings on a coarse grid, and its step [N].

    Readings off the grid are impossible there; on it each stands for its interval.
    Without the grid readings fall anywhere on the finest scale that they can show.

    Args:
        setting: the case.
        sd: of the prior of the step [N].
    """
    readings = np.asarray(setting.records.force)
    step, finest = lattice_step(readings, setting.noise_sd)
    if not _LEAST_STEP <= step / setting.noise_sd <= _MOST_STEP:
        return -np.inf, 0.0
    # A step above the noise hides most of it: an interval then has probability one.
    gain = len(readings) * np.log(min(step, 2.0 * setting.noise_sd) / finest)
    prior = -0.5 * (step / (3.0 * sd)) ** 2 + np.log(finest / (3.0 * sd))
    return float(gain + prior), step
