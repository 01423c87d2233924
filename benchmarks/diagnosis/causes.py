"""Effects of a given visible size: drawn from their priors, scaled to r.

r = RMS(P·effect)/σ with P what the base model leaves. Shapes come from their priors;
the amplitude is then what gives r, at most `MOST` prior sds from zero.
"""

from dataclasses import dataclass
from functools import lru_cache, partial

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.diagnosis.world import READING, World
from hdcal.data.priors import effect_priors
from hdcal.data.records import Records
from hdcal.inference.distributions import frozen
from hdcal.physics.chain import predict_reading
from hdcal.physics.effect import Effect, parameters
from hdcal.physics.effects.scatter import Scatter, scores
from hdcal.physics.registry import EFFECTS

MOST = 4.0
# Shape points, and steps of the amplitude among which r is sought.
_SHAPES, _STEPS = 96, 40
_SMALLEST = 1e-3


@dataclass(frozen=True)
class Drawn:
    """One effect at size r.

    Attributes:
        curve: what it adds to the readings [N], shape (n,).
        amplitude: its value if it is the only one, else None.
    """

    curve: np.ndarray
    amplitude: float | None


@lru_cache
def priors():
    return effect_priors()


def testable(records: Records) -> list[str]:
    """Return the effects on the mean that a program can test."""
    return [
        name
        for name, effect in EFFECTS.items()
        if effect.stage != "noise" and not effect.needs - records.known
    ]


def amplitudes(name: str) -> list[str]:
    return [n for n, p in parameters(EFFECTS[name]).items() if p.null is not None]


def several(name: str) -> bool:
    """Return whether an effect has several amplitudes; all such are linear in them."""
    return issubclass(EFFECTS[name], Scatter) or len(amplitudes(name)) > 1


def signs(name: str) -> tuple[float, ...]:
    """Return the signs that the prior of the amplitude allows."""
    prior = priors()[f"{name}.{amplitudes(name)[0]}"]
    centred = prior.family == "normal" and float(prior.numbers[0]) == 0.0
    return (1.0, -1.0) if centred else (1.0,)


def largest(name: str) -> float:
    """Return the largest amplitude that is made."""
    prior = priors()[f"{name}.{amplitudes(name)[0]}"]
    mean = float(prior.numbers[0]) if prior.family == "normal" else 0.0
    return abs(mean) + MOST * float(prior.numbers[-1])


def draw(name: str, world: World, r: float, rng: np.random.Generator) -> Drawn | None:
    """Return an effect at size r, None where no physical amplitude reaches it."""
    at = rng.uniform(size=_SHAPES)
    if several(name):
        return _draw_several(name, world, r, at, rng)
    sign = float(rng.choice(signs(name)))
    found, values = reaching(name, world, r, shapes(name, at), sign)
    if not len(found):
        return None
    return Drawn(found[0], float(values[0]))


def _draw_several(name: str, world: World, r: float, at, rng) -> Drawn | None:
    """Draw a direction among the amplitudes, then scale it."""
    for columns in directions(name, world, shapes(name, at))[:30]:
        weights = rng.normal(size=len(columns))
        scale = r / world.size(weights @ columns)
        if scale * np.max(np.abs(weights)) <= MOST:
            return Drawn(scale * weights @ columns, None)
    return None


def shapes(name: str, at: np.ndarray | None = None) -> dict[str, np.ndarray]:
    """Return values of the shape parameters at quantiles, evenly spaced by default."""
    if at is None:
        at = (np.arange(_SHAPES) + 0.5) / _SHAPES
    found = {}
    for field in parameters(EFFECTS[name]):
        prior = priors()[f"{name}.{field}"]
        if field in amplitudes(name):
            continue
        fixed = prior.family == "fixed"
        found[field] = (
            np.full(len(at), float(prior.numbers[0]))
            if fixed
            else frozen(prior).ppf(at)
        )
    return found or {"": np.zeros(1)}


def reaching(
    name: str, world: World, r: float, shape: dict[str, np.ndarray], sign: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the curves of size r of those shapes that reach it, and amplitudes."""
    steps = sign * largest(name) * np.geomspace(_SMALLEST, 1.0, _STEPS)
    count = len(next(iter(shape.values())))
    grid = {n: np.repeat(v, _STEPS) for n, v in shape.items() if n}
    grid[amplitudes(name)[0]] = np.tile(steps, count)
    size = world.size(_curves(name, world, grid)).reshape(count, _STEPS)
    reached = np.flatnonzero(size.max(axis=1) >= r)
    after = np.maximum(np.argmax(size >= r, axis=1), 1)[reached]
    low, high = (np.log(size[reached, after - k] + 1e-300) for k in (1, 0))
    place = np.clip((np.log(r) - low) / (high - low), 0.0, 1.0)
    log_steps = np.log(np.abs(steps))
    value = log_steps[after - 1] + place * (log_steps[after] - log_steps[after - 1])
    value = sign * np.exp(value)
    if not len(value):
        return np.zeros((0, len(world.plain))), value
    full = np.concatenate([value, np.full(count - len(value), value[0])])
    used = np.concatenate([reached, np.full(count - len(value), reached[0])])
    grid = {n: v[used] for n, v in shape.items() if n}
    grid[amplitudes(name)[0]] = full
    return _curves(name, world, grid)[: len(value)], value


def directions(name: str, world: World, shape: dict[str, np.ndarray]) -> np.ndarray:
    """Return what one prior sd of each amplitude adds, shape (s, j, n)."""
    effect, fields = EFFECTS[name], amplitudes(name)
    unit = [float(priors()[f"{name}.{f}"].numbers[-1]) for f in fields]
    if issubclass(effect, Scatter):
        label = np.asarray(getattr(world.records, effect.members))
        whole = _curves(name, world, {fields[0]: np.array(unit)})[0]
        each = whole / np.asarray(scores(label))
        return np.repeat((each * (label == np.unique(label)[:, None]))[None], 30, 0)
    count = len(next(iter(shape.values())))
    grid = {n: np.repeat(v, len(fields)) for n, v in shape.items() if n}
    for index, field in enumerate(fields):
        one = unit[index] * (np.arange(len(fields)) == index)
        grid[field] = np.tile(one, count)
    found = _curves(name, world, grid)
    return found.reshape(count, len(fields), -1)


@partial(jax.jit, static_argnames=("effect", "names"))
def _contributions(effect: type[Effect], names, table, base, records):
    plain = predict_reading(base, (), records, READING)[0]

    def one(row):
        made = effect(**dict(zip(names, row, strict=True)))
        return predict_reading(base, (made,), records, READING)[0] - plain

    return jax.vmap(one)(table)


def _curves(name: str, world: World, values: dict[str, np.ndarray]) -> np.ndarray:
    table = jnp.asarray(np.stack(list(values.values()), axis=1))
    found = _contributions(
        EFFECTS[name], tuple(values), table, world.base, world.records
    )
    return np.asarray(found)
