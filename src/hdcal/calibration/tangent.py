"""The stiffness at the end of the tested range, with the effects of the model.

K and the stiffness of the straight model leave effects out: behind the onset of a
second contact a gear is stiffer than they say.
"""

import jax
import numpy as np

from hdcal.exported import jit
from hdcal.inference.posterior import Posterior
from hdcal.inference.problem import Problem
from hdcal.inference.values import Values
from hdcal.prediction.forces import force_of, grid_records
from hdcal.report.item import Interval

# Length of the secant as a share of the largest deformation: short beside what an
# effect changes, and long beside the rounding of its corners.
_SECANT = 0.02


def tangent_stiffness(posterior: Posterior) -> tuple[float, Interval] | None:
    """Return the largest tested deformation [mm] and the stiffness there [N/mm].

    Both as read. None where the model has no effect that changes it at once.
    """
    own = [e for e in posterior.effects if e.stage in ("deformation", "force")]
    if not any(effect.instantaneous for effect in own):
        return None
    case = posterior.case
    deformation = np.asarray(case.records.deformation)
    largest = float(deformation[np.argmax(np.abs(deformation))])
    before = (1.0 - _SECANT) * largest
    warm = np.full(2, case.gear.reference_temperature)
    rows = grid_records(np.array([before, largest]), warm, np.ones(2), 0.0)
    forces = np.asarray(_forces(posterior.problem, posterior.draws, rows))
    return largest, Interval.of(np.diff(forces, axis=1)[:, 0] / (largest - before))


@jit
def _forces(problem: Problem, values: Values, rows):
    return jax.vmap(lambda one: force_of(problem, one, rows, quantity="load")[0])(
        values
    )
