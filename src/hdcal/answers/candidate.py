"""One material with the sizes nearest to the tested gear that keep every limit."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hdcal.answers.basis import Basis
from hdcal.answers.nearest import CLOSE, nearest_kept
from hdcal.answers.sizes import SIZES
from hdcal.answers.target import Target
from hdcal.rig.records import Geometry

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
    geometry, names = _geometry(basis), list(bounds)
    own = np.log([float(getattr(geometry, SIZES[name])) for name in names])
    ends = np.log([bounds[name] for name in names]).reshape(-1, 2)

    def excess(z):
        place = dict(zip(names, jnp.exp(z), strict=True))
        place |= {"deformation_mm": deformation, **_NEUTRAL}
        force = target.force(geometry, place) / limit
        # Without a strength the share is zero, whose logarithm has no slope.
        stress = target.utilisation(geometry, place) + 1e-12
        return jnp.log(jnp.stack([force, stress]))

    values, slopes = jax.jit(excess), jax.jit(jax.jacfwd(excess))
    z = own
    if names:
        z = nearest_kept(
            lambda y: np.asarray(values(y)),
            lambda y: np.asarray(slopes(y)),
            own,
            ends,
        )
    sizes = dict(zip(names, map(float, np.exp(z)), strict=True))
    return candidate(basis, target, sizes, deformation, limit)


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
    place = {**sizes, "deformation_mm": deformation, **_NEUTRAL}
    drawn = replace(geometry, **{SIZES[name]: v for name, v in sizes.items()})
    forces = np.asarray(_all_forces(target, drawn, deformation))
    share = float(target.utilisation(geometry, place))
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
        stresses=np.asarray(target.stresses(drawn, deformation, 1.0)),
        kept=float(np.mean(forces <= limit * (1.0 + CLOSE))),
    )


@eqx.filter_jit
def _all_forces(target: Target, geometry, deformation):
    return target.forces(geometry, deformation, 1.0, 1.0)


def elasticities(
    chosen: Candidate, target: Target, deformation: float
) -> dict[str, float]:
    """Return d ln F / d ln x of the kept force by sizes, ω, modulus and K."""
    geometry = _geometry(chosen.basis)
    names = ("wall_thickness_mm", "radius_mm", "length_mm")
    sizes = {name: float(getattr(geometry, SIZES[name])) for name in names}
    place = {**sizes, **chosen.sizes, "deformation_mm": deformation, **_NEUTRAL}
    place = {name: jnp.asarray(value, dtype=float) for name, value in place.items()}
    found = target.elasticities(geometry, place)
    return {name: float(value) for name, value in found.items()}
