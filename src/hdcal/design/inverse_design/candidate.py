"""The sizes nearest to the tested gear that keep every limit, for one material."""

from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from hdcal.design.design_draws import DesignDraws
from hdcal.design.design_result import Stress, counted, stress_fields
from hdcal.design.inverse_design.force_limit import LimitedGear
from hdcal.design.inverse_design.nearest_point import CLOSE, nearest_kept
from hdcal.exported import jit
from hdcal.prediction.engine.sizes import SIZES
from hdcal.report.item import Interval, Probability, quantity

# Draws on either side of a quantile from which its slope is computed.
_BESIDE = 50


class CandidateForce(Interval):
    """A force, and the one that is not exceeded with the required probability."""

    kept: float


class Candidate(Stress):
    """One material with the sizes that were found best for it.

    Attributes:
        material: name.
        sizes_mm: by name, without the unit.
        met: whether every limit is kept.
        change: √Σ (ln x/x₀)², the distance from the tested gear.
        force_N: with its sign.
        probability: that the force keeps the limit.
        standard_error: of the probability.
        utilisation_kept: share of the allowed stress that is not exceeded with the
            required probability; None where no strength is known.
    """

    material: str = quantity("material")
    sizes_mm: dict[str, float] = quantity("sizes", "mm")
    met: bool = quantity("limits kept")
    change: float = quantity("distance from the tested gear")
    force_N: CandidateForce = quantity("force", "N")
    probability: Probability = quantity("probability of keeping the limit")
    standard_error: float = quantity("standard error of the probability")
    utilisation_kept: float | None = quantity("share of the allowed stress kept")

    @property
    def sizes(self) -> dict[str, float]:
        """Sizes [mm] by name with the unit, such as `radius_mm`."""
        return {f"{name}_mm": value for name, value in self.sizes_mm.items()}

    def columns(self) -> dict[str, Any]:
        """Return numbers and texts by the names of columns, the sizes among them."""
        kept = {"force_kept_N": self.force_N.kept}
        return {**super().columns(), **kept, **self.sizes}


def best_candidate(
    draws: DesignDraws, target: LimitedGear, bounds: Mapping[str, tuple[float, float]]
) -> Candidate:
    """Return the best sizes of one material.

    Args:
        draws: of this material.
        target: of the same.
        bounds: of each free size [mm] by name.
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
    """Return force, stress and probability of given sizes [mm], by name."""
    forces, stresses = map(np.asarray, _draws(target, dict(sizes)))
    share = float(np.sort(stresses / target.limit_stress)[target.rank])
    force = float(np.sort(forces)[target.rank])
    limited = bool(np.isfinite(target.limit_stress).all())
    steps = [np.log(value / _own(target, name)) for name, value in sizes.items()]
    most = target.limit_force * (1.0 + CLOSE)
    probability, error = counted(float(np.mean(forces <= most)), draws)
    sense = float(target.sense)
    interval = Interval.of(sense * forces)
    return Candidate(
        **stress_fields(draws, stresses),
        material=draws.material,
        sizes_mm={name.removesuffix("_mm"): value for name, value in sizes.items()},
        met=force <= most and (not limited or share <= 1.0 + CLOSE),
        change=float(np.sqrt(np.sum(np.square(steps)))),
        force_N=CandidateForce(**dict(interval), kept=sense * force),
        probability=probability,
        standard_error=error,
        utilisation_kept=share if limited else None,
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
        target: of the population.
        sizes: [mm] by name, shape (m,).
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
    # The slope of a quantile is the mean slope of the draws about it: Hong, Operations
    # Research 57 (2009). That of a single draw would be imprecise.
    order = jnp.argsort(target.forces(place))
    half = min(_BESIDE, target.rank, len(order) - 1 - target.rank)
    about = order[target.rank - half : target.rank + half + 1]
    mean = jax.value_and_grad(lambda place: target.forces(place)[about].mean())
    force, slopes = mean(place)
    return {name: slope * place[name] / force for name, slope in slopes.items()}
