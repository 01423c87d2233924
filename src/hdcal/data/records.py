"""The measured records and the gear's geometry, in mm, N, MPa, °C, s and rad."""

from typing import Any

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Float, Int

from hdcal.jax_settings import use_double_precision

# Measured on the reading edge as NumPy arrays, traced as JAX arrays.
Array = jax.Array | np.ndarray


class _InDoublePrecision(eqx.Module):
    """Inputs of computations; making one switches JAX to double precision."""

    def __post_init__(self) -> None:
        use_double_precision(self)

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        use_double_precision(self)


class Geometry(_InDoublePrecision):
    """Size of the flexspline; every leaf may be differentiated; NaN of a spring.

    Attributes:
        wall_thickness: δ [mm].
        radius: R of the neutral surface [mm].
        length: axial length L [mm].
        load_height: distance c of the load from the closed base [mm].
        poisson: Poisson's ratio ν [-].
    """

    wall_thickness: Float[Array, ""] | float
    radius: Float[Array, ""] | float
    length: Float[Array, ""] | float
    load_height: Float[Array, ""] | float
    poisson: Float[Array, ""] | float


class Records(_InDoublePrecision):
    """Rows in the order they were taken; absent covariates hold neutral values.

    Attributes:
        deformation: as read [mm], radial or diametral by the gear file.
        temperature: of the specimen [°C]; the reference one when not measured.
        time: since the reset of the row's run [s]; 0 when not measured.
        angle: rotation of the specimen under the load [rad]; 0 when not measured.
        direction: +1 loading, 0 holding, -1 unloading.
        sense: sign of the last movement, +1 or -1; a hold keeps it, and a turning row
            has that of the branch its force fits.
        rate: deformation rate [mm/s]; 0 without time.
        run: index of the mounting.
        force: as read [N].
        force_sd: known measurement sd [N]; 0 when not given.
        known: what was measured or is present in the loading: temperature, time, angle,
            force_sd, run, specimen (two or more labels), runs, specimens (three or
            more), unloading, holds, rates, holds or rates, cycles.
    """

    deformation: Float[Array, " n"]
    temperature: Float[Array, " n"]
    time: Float[Array, " n"]
    angle: Float[Array, " n"]
    direction: Float[Array, " n"]
    sense: Float[Array, " n"]
    rate: Float[Array, " n"]
    run: Int[Array, " n"]
    specimen: Int[Array, " n"]
    force: Float[Array, " n"]
    force_sd: Float[Array, " n"]
    known: frozenset[str] = eqx.field(static=True)


# Names of features in messages, where their own do not say what is needed.
FEATURE_WORDS = {"holds or rates": "holds or several rates"}
# Readings of a test that begins at the origin have their middle at half their range.
_FAR = 1.0
# Source of the prior of the zero of readings that are positions.
OF_POSITIONS = "readings of a position: where their straight line has no force"


def lies_far(deformation: Array) -> bool:
    """Return whether deformations lie far from their origin for their range."""
    low, high = float(np.min(deformation)), float(np.max(deformation))
    return abs(low + high) / 2.0 > _FAR * (high - low)


def less_run_means(values: np.ndarray, run: np.ndarray) -> np.ndarray:
    """Return values less the mean of their run, shape (n,)."""
    count = np.maximum(np.bincount(run), 1)
    return values - (np.bincount(run, values) / count)[run]
