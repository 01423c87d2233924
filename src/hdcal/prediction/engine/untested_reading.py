"""What untested conditions add to one reading at a time, as a shift and its sd."""

import jax
import jax.numpy as jnp
import numpy as np

from hdcal.inference.posterior import Posterior
from hdcal.inference.problem import Problem
from hdcal.inference.values import Values
from hdcal.prediction.engine.forces import force_of, grid_records
from hdcal.prediction.engine.gear_forces import CAUSE, gear_values
from hdcal.prediction.engine.untested import Untested

# Draws that tell: their sd is then known to some 5 %.
_DRAWS = 256


class UntestedReading:
    """The bend and the drift of the rig at conditions that were not tested.

    Args:
        posterior: of one model, or a mixture.
    """

    def __init__(self, posterior: Posterior):
        values, self._untested = gear_values(posterior)
        kept = np.linspace(0, len(values["K"]) - 1, _DRAWS).astype(int)
        self._values = {name: column[kept] for name, column in values.items()}
        self._problem = posterior.problem

    def at(self, deformation: float, temperature: float) -> tuple[float, float]:
        """Return mean and sd of what is added to a reading [N].

        Args:
            deformation: as read [mm].
            temperature: of the specimen [°C].
        """
        row = np.array([deformation]), np.array([temperature])
        added = np.asarray(_added(self._problem, self._values, self._untested, *row))
        return float(added.mean()), float(added.std())


@jax.jit
def _added(problem: Problem, values: Values, untested: Untested, at, warm):
    loading = jnp.where(at < 0.0, -1.0, 1.0)
    records = grid_records(at, warm, loading, 0.0)

    def one(value):
        own = jax.tree.map(lambda leaf: leaf[value[CAUSE]], untested)
        zero, moved = own.drift(value, warm, loading)
        drifted, _ = force_of(problem, value, records, zero=zero, moved=moved)
        still, _ = force_of(problem, value, records)
        bend, _ = own.leftover(problem, value, at, loading)
        return (drifted - still + bend)[0]

    return jax.vmap(one)(values)
