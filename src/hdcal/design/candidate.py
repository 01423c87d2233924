"""One material with the sizes nearest to the tested gear that keep every limit."""

from collections.abc import Mapping
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from hdcal.design.design_draws import DesignDraws
from hdcal.design.force_limit import LimitedGear
from hdcal.design.nearest_point import CLOSE, nearest_kept
from hdcal.exported import jit
from hdcal.prediction.engine.sizes import SIZES

# Draws on either side of a quantile that tell its slope.
_BESIDE = 50


@dataclass(frozen=True)
class Candidate:
    """One material with the best sizes that were found for it.

    Forces are along the sense of loading.

    Attributes:
        basis: draws, of this material.
        sizes: [mm] by edge name.
        met: whether every limit is kept.
        change: √Σ (ln x/x₀)², the distance from the tested gear [-].
        force: kept with the required probability [N].
        utilisation: share of the allowed stress that is kept with it; None where no
            strength is known.
        forces: of each draw [N].
        stresses: hoop bending stress under the load of each draw [MPa].
        kept: share of the draws whose force keeps the limit.
    """

    basis: DesignDraws
    sizes: Mapping[str, float]
    met: bool
    change: float
    force: float
    utilisation: float | None
    forces: np.ndarray
    stresses: np.ndarray
    kept: float


def best_candidate(
    draws: DesignDraws, target: LimitedGear, bounds: Mapping[str, tuple[float, float]]
) -> Candidate:
    """Return the best sizes of one material.

    Args:
        draws: of this material.
        target: of the same.
        bounds: of each free size [mm] by edge name.
    """
    names = tuple(bounds)
    own = np.log([_own(target, name) for name in names])
    ends = np.log([bounds[name] for name in names]).reshape(-1, 2)
    z = own
    if names:
        z = nearest_kept(
            lambda y: np.asarray(_excess(target, y, names=names)),
            lambda y: np.asarray(_slopes(target, y, names=names)),
            own,
            ends,
        )
    sizes = dict(zip(names, map(float, np.exp(z)), strict=True))
    return candidate(draws, target, sizes)


def _own(target: LimitedGear, name: str) -> float:
    return float(getattr(target.drawing, SIZES[name]))


# Compiled once for all materials: everything but the names is an argument.
@jit(static_argnames=("names",))
def _excess(target: LimitedGear, z, *, names):
    """Return the logarithms of force and stress over what is allowed."""
    place = dict(zip(names, jnp.exp(z), strict=True))
    force = target.force(place) / target.limit_force
    # Without a strength the share is zero, whose logarithm has no slope.
    return jnp.log(jnp.stack([force, target.utilisation(place) + 1e-12]))


@jit(static_argnames=("names",))
def _slopes(target: LimitedGear, z, *, names):
    """Return their derivatives."""
    return jax.jacfwd(lambda y: _excess(target, y, names=names))(z)


def candidate(
    draws: DesignDraws, target: LimitedGear, sizes: Mapping[str, float]
) -> Candidate:
    """Return what given sizes [mm] come to, by edge name."""
    forces, stresses = map(np.asarray, _draws(target, dict(sizes)))
    share = float(np.sort(stresses / target.limit_stress)[target.rank])
    force = float(np.sort(forces)[target.rank])
    limited = bool(np.isfinite(target.limit_stress).all())
    steps = [np.log(value / _own(target, name)) for name, value in sizes.items()]
    most = target.limit_force * (1.0 + CLOSE)
    return Candidate(
        basis=draws,
        sizes=sizes,
        met=force <= most and (not limited or share <= 1.0 + CLOSE),
        change=float(np.sqrt(np.sum(np.square(steps)))),
        force=force,
        utilisation=share if limited else None,
        forces=forces,
        stresses=stresses,
        kept=float(np.mean(forces <= most)),
    )


@jit
def _draws(target: LimitedGear, sizes):
    return target.forces(sizes), target.stresses(sizes)


def spreads(
    target: LimitedGear, sizes: Mapping[str, np.ndarray], shares: np.ndarray
) -> np.ndarray:
    """Return quantiles of the force, and the force kept, for many sizes [N].

    All of them are along the sense of loading.

    Args:
        target: tells the population.
        sizes: [mm] by edge name, shape (m,).
        shares: probabilities, shape (q,).

    Returns:
        Shape (q + 1, m), the kept force last.
    """
    return np.asarray(_spreads(target, dict(sizes), shares)).T


@jit
def _spreads(target: LimitedGear, sizes, shares):
    def one(place):
        ranked = jnp.sort(target.forces(place))
        return jnp.append(jnp.quantile(ranked, shares), ranked[target.rank])

    # One after the other: all at once would take a gigabyte.
    return jax.lax.map(one, sizes)


def elasticities(target: LimitedGear, sizes: Mapping[str, float]) -> dict[str, float]:
    """Return d ln F / d ln x of the kept force by sizes, ω, modulus and K."""
    names = ("wall_thickness_mm", "radius_mm", "length_mm")
    place = {name: _own(target, name) for name in names} | dict(sizes)
    place |= {"deformation_mm": float(target.deformation), "modulus": 1.0, "K": 1.0}
    found = _elasticities(target, place)
    return {name: float(value) for name, value in found.items()}


@jit
def _elasticities(target: LimitedGear, place):
    # The slope of a quantile is the mean slope of the draws about it, of which one
    # alone is a rough number: Hong, Operations Research 57 (2009).
    order = jnp.argsort(target.forces(place))
    half = min(_BESIDE, target.rank, len(order) - 1 - target.rank)
    about = order[target.rank - half : target.rank + half + 1]
    mean = jax.value_and_grad(lambda place: target.forces(place)[about].mean())
    force, slopes = mean(place)
    return {name: slope * place[name] / force for name, slope in slopes.items()}
