"""What untested conditions add to readings one by one, by unknowns that they share."""

from dataclasses import dataclass
from math import hypot

import jax
import jax.numpy as jnp
import numpy as np

from hdcal.exported import jit
from hdcal.inference.discrepancy import Discrepancy
from hdcal.inference.problem import Problem
from hdcal.inference.values import Values
from hdcal.prediction.engine.forces import force_of, grid_records
from hdcal.prediction.engine.gear_forces import CAUSE, gear_values
from hdcal.prediction.engine.growth import Growth, bend_covariance
from hdcal.prediction.engine.pooled import Pooled
from hdcal.prediction.engine.untested import BENDS, Untested, fitted_columns

# Draws that tell: their sd is then known to some 5 %.
_DRAWS = 256
# Places whose bends stand for the whole, in tested ranges beyond the end.
_NODES = np.geomspace(0.1, 6.0, 12)
# Variance that rounding may take off that of the places, as a share.
_ROUNDING = 1e-10
# Unknowns that all readings share: a drift of the rig, and the bends beyond each end.
UNKNOWNS = 1 + 2 * len(_NODES)


@dataclass(frozen=True)
class Addition:
    """What untested conditions add to one reading.

    Attributes:
        shift: its mean [N].
        columns: of unknowns that are the same at every reading, independent and
            standard normal, shape (UNKNOWNS,) [N].
        rest: sd of what they do not hold [N].
    """

    shift: float
    columns: np.ndarray
    rest: float


class UntestedReading:
    """The bend and the drift of the rig at conditions that were not tested.

    Args:
        pooled: draws of all causes.
    """

    def __init__(self, pooled: Pooled):
        values, self._untested = gear_values(pooled)
        kept = np.linspace(0, len(values["K"]) - 1, _DRAWS).astype(int)
        self._values = {name: column[kept] for name, column in values.items()}
        self._problem = pooled.problem
        sides = self._untested.below, self._untested.above
        self._bends = [
            _Bend(growth, self._values[BENDS][:, side], self._values[CAUSE])
            for side, growth in enumerate(sides)
        ]
        warm = pooled.case.records.temperature
        self._tested = float(np.min(warm)), float(np.max(warm))

    def at(self, deformation: float, temperature: float) -> Addition:
        """Return what is added to a reading.

        Args:
            deformation: as read [mm].
            temperature: of the specimen [°C].
        """
        drift, mean = self._drift(deformation, temperature)
        bends = [bend.at(deformation) for bend in self._bends]
        return Addition(
            mean + sum(bend.shift for bend in bends),
            np.concatenate([[drift], *(bend.columns for bend in bends)]),
            hypot(*(bend.rest for bend in bends)),
        )

    def leftover(self, deformation: np.ndarray) -> np.ndarray:
        """Return what each weight of the fitted leftover adds to readings [-].

        Args:
            deformation: as read [mm], shape (n,).

        Returns:
            Shape (n, weight); no weight where no leftover was fitted.
        """
        if self._problem.discrepancy is None:
            return np.empty((len(deformation), 0))
        growths = tuple(bend.growth for bend in self._bends)
        return np.asarray(_leftover(self._problem.discrepancy, growths, deformation))

    def half_loop(self, deformation: float) -> float:
        """Return the mean square of half the fitted leftover's loop [N²].

        A stream does not say which way it moves: of what goes with the direction the
        middle is followed, and this is the variance about it.

        Args:
            deformation: as read [mm].
        """
        discrepancy = self._problem.discrepancy
        if discrepancy is None or not discrepancy.looped:
            return 0.0
        growths = tuple(bend.growth for bend in self._bends)
        at, weights = np.array([deformation]), self._values["gap_weights"]
        return float(_half_loop(discrepancy, growths, at, weights))

    def _drift(self, deformation: float, temperature: float) -> tuple[float, float]:
        """Return sd, with the sign of the kelvins, and mean of the rig's drift [N]."""
        coldest, warmest = self._tested
        if coldest <= temperature <= warmest:
            return 0.0, 0.0
        row = np.array([deformation]), np.array([temperature])
        found = np.asarray(_drifts(self._problem, self._values, self._untested, *row))
        sign = 1.0 if temperature > warmest else -1.0
        return sign * float(found.std()), float(found.mean())


class _Bend:
    """The bend beyond one end, by its values at a few places.

    Args:
        growth: of every cause, each leaf (cause, …).
        sizes: of the bend and noise that goes with it, (draw, 2) [N].
        cause: of the draws.
    """

    def __init__(self, growth: Growth, sizes: np.ndarray, cause: np.ndarray):
        # The causes have the same rows, and so the same ends.
        self.growth: Growth = jax.tree.map(lambda leaf: leaf[0], growth)
        found, known = map(np.asarray, _given(growth, sizes, cause))
        self._mean, square = found.mean(axis=0), sizes[:, 0] ** 2
        self._square = float(square.mean())
        known = (square[:, None, None] * known).mean(axis=0)
        self._known = np.cov(found.T, bias=True) - 0.5 * (known + known.T)
        nodes = 1.0 + _NODES
        spread = self._covariance(nodes, nodes)
        spread += np.diag(_ROUNDING * np.diag(spread))
        self._root = np.linalg.inv(np.linalg.cholesky(spread))

    def at(self, deformation: float) -> Addition:
        """Return what it adds to a reading at a deformation as read [mm]."""
        beyond, share = map(float, _reach(self.growth, deformation))
        if share == 0.0:
            return Addition(0.0, np.zeros(len(_NODES)), 0.0)
        place = np.array([1.0 + beyond])
        columns = self._root @ self._covariance(1.0 + _NODES, place)[:, 0]
        rest = float(self._covariance(place, place)[0, 0]) - float(columns @ columns)
        mean = float(_powers(place)[0] @ self._mean)
        return Addition(share * mean, share * columns, share * max(rest, 0.0) ** 0.5)

    def _covariance(self, place: np.ndarray, other: np.ndarray) -> np.ndarray:
        """Return that of the bend between places beyond the end, (k, n) [N²]."""
        free = self._square * bend_covariance(place, other)
        return free + _powers(place) @ self._known @ _powers(other).T


def _powers(place: np.ndarray) -> np.ndarray:
    return place[:, None] ** np.arange(3)


@jit
def _reach(growth: Growth, deformation):
    """Return how far beyond the end a deformation is, and the share of the bend."""
    return growth.beyond(deformation), growth.share(deformation)


@jit
def _leftover(discrepancy: Discrepancy, growths: tuple[Growth, Growth], deformation):
    """Return the columns of the fitted leftover; growths below and above."""
    return _columns(discrepancy, growths, deformation, jnp.zeros_like(deformation))


@jit
def _half_loop(discrepancy: Discrepancy, growths, deformation, weights):
    """Return the mean square over draws of what loading adds to the middle."""
    up, middle = (
        _columns(discrepancy, growths, deformation, movement * jnp.ones(1))
        for movement in (1.0, 0.0)
    )
    return jnp.mean((weights @ (up - middle)[0]) ** 2)


def _columns(discrepancy: Discrepancy, growths, deformation, movement):
    below, above = growths
    over = deformation > above.far
    share = jnp.where(over, above.share(deformation), below.share(deformation))
    ends = above.far, below.far
    return fitted_columns(discrepancy, ends, (deformation, movement), share)


@jit
def _given(growth: Growth, sizes, cause):
    """Return what `Growth.given` says of every draw."""

    def one(pair, index):
        return jax.tree.map(lambda leaf: leaf[index], growth).given(*pair)

    return jax.vmap(one)(sizes, cause)


@jit
def _drifts(problem: Problem, values: Values, untested: Untested, at, warm):
    """Return what the rig's drift adds to a reading in every draw [N]."""
    loading = jnp.where(at < 0.0, -1.0, 1.0)
    records = grid_records(at, warm, loading, 0.0)

    def one(value):
        own = jax.tree.map(lambda leaf: leaf[value[CAUSE]], untested)
        zero, moved = own.drift(value, warm, loading)
        drifted, _ = force_of(problem, value, records, zero=zero, moved=moved)
        still, _ = force_of(problem, value, records)
        return (drifted - still)[0]

    return jax.vmap(one)(values)
