"""One material with the sizes nearest to the tested gear that keep every limit."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from hdcal.data.records import Geometry
from hdcal.design.design_draws import Basis
from hdcal.design.force_limit import Target
from hdcal.design.nearest_point import CLOSE, nearest_kept
from hdcal.design.sizes import SIZES, geometry_with

_NEUTRAL = {"modulus": 1.0, "K": 1.0}


@dataclass(frozen=True)
class Candidate:
    """One material with the best sizes that were found for it.

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

    basis: Basis
    sizes: Mapping[str, float]
    met: bool
    change: float
    force: float
    utilisation: float | None
    forces: np.ndarray
    stresses: np.ndarray
    kept: float


def solve(
    basis: Basis,
    target: Target,
    bounds: Mapping[str, tuple[float, float]],
    deformation: float,
    limit: float,
) -> Candidate:
    """Return the best sizes of one material.

    Args:
        basis: draws, of this material.
        target: of the same.
        bounds: of each free size [mm] by edge name.
        deformation: radial [mm].
        limit: of the force [N].
    """
    geometry, names = _geometry(basis), tuple(bounds)
    own = np.log([float(getattr(geometry, SIZES[name])) for name in names])
    ends = np.log([bounds[name] for name in names]).reshape(-1, 2)
    question = target, geometry, deformation, limit
    z = own
    if names:
        z = nearest_kept(
            lambda y: np.asarray(_excess(*question, y, names)),
            lambda y: np.asarray(_slopes(*question, y, names)),
            own,
            ends,
        )
    sizes = dict(zip(names, map(float, np.exp(z)), strict=True))
    return candidate(basis, target, sizes, deformation, limit)


# Compiled once for all materials: everything but the names is an argument.
@partial(jax.jit, static_argnames="names")
def _excess(target: Target, geometry, deformation, limit, z, names):
    """Return the logarithms of force and stress over what is allowed."""
    place = dict(zip(names, jnp.exp(z), strict=True))
    place |= {"deformation_mm": deformation, **_NEUTRAL}
    force = target.force(geometry, place) / limit
    # Without a strength the share is zero, whose logarithm has no slope.
    stress = target.utilisation(geometry, place) + 1e-12
    return jnp.log(jnp.stack([force, stress]))


_slopes = partial(jax.jit, static_argnames="names")(jax.jacfwd(_excess, argnums=4))


def _geometry(basis: Basis) -> Geometry:
    return replace(basis.gear.geometry, poisson=basis.poisson)


def candidate(
    basis: Basis,
    target: Target,
    sizes: Mapping[str, float],
    deformation: float,
    limit: float,
) -> Candidate:
    """Return what given sizes [mm] come to; arguments are those of `solve`."""
    geometry = _geometry(basis)
    drawn = geometry_with(geometry, sizes)
    forces, stresses = map(np.asarray, _draws(target, drawn, deformation))
    share = float(np.sort(stresses / target.limit)[target.rank])
    force = float(np.sort(forces)[target.rank])
    limited = bool(np.isfinite(target.limit).all())
    steps = [np.log(v / getattr(geometry, SIZES[name])) for name, v in sizes.items()]
    within = force <= limit * (1.0 + CLOSE)
    return Candidate(
        basis=basis,
        sizes=sizes,
        met=within and (not limited or share <= 1.0 + CLOSE),
        change=float(np.sqrt(np.sum(np.square(steps)))),
        force=force,
        utilisation=share if limited else None,
        forces=forces,
        stresses=stresses,
        kept=float(np.mean(forces <= limit * (1.0 + CLOSE))),
    )


@jax.jit
def _draws(target: Target, geometry, deformation):
    forces = target.forces(geometry, deformation, 1.0, 1.0)
    return forces, target.stresses(geometry, deformation, 1.0)


def spreads(
    basis: Basis,
    target: Target,
    sizes: Mapping[str, np.ndarray],
    deformation: float,
    shares: np.ndarray,
) -> np.ndarray:
    """Return quantiles of the force, and the force kept, for many sizes [N].

    Args:
        basis: draws, of the target's material.
        target: tells the population.
        sizes: [mm] by edge name, shape (m,).
        deformation: radial [mm].
        shares: probabilities, shape (q,).

    Returns:
        Shape (q + 1, m), the kept force last.
    """
    return np.asarray(
        _spreads(target, _geometry(basis), deformation, dict(sizes), shares)
    ).T


@jax.jit
def _spreads(target: Target, geometry, deformation, sizes, shares):
    def one(point):
        drawn = geometry_with(geometry, point)
        ranked = jnp.sort(target.forces(drawn, deformation, 1.0, 1.0))
        return jnp.append(jnp.quantile(ranked, shares), ranked[target.rank])

    # One after the other: all at once would take a gigabyte.
    return jax.lax.map(one, sizes)


def elasticities(
    chosen: Candidate, target: Target, deformation: float
) -> dict[str, float]:
    """Return d ln F / d ln x of the kept force by sizes, ω, modulus and K."""
    geometry = _geometry(chosen.basis)
    names = ("wall_thickness_mm", "radius_mm", "length_mm")
    sizes = {name: float(getattr(geometry, SIZES[name])) for name in names}
    place = {**sizes, **chosen.sizes, "deformation_mm": deformation, **_NEUTRAL}
    place = {name: jnp.asarray(value, dtype=float) for name, value in place.items()}
    found = _elasticities(target, geometry, place)
    return {name: float(value) for name, value in found.items()}


@jax.jit
def _elasticities(target: Target, geometry, place):
    force, slopes = jax.value_and_grad(lambda x: target.force(geometry, x))(place)
    return {name: slope * place[name] / force for name, slope in slopes.items()}
