"""How finely the data resolve each amplitude: the unit of its coordinate."""

from collections.abc import Mapping, Sequence

import jax
import numpy as np

from hdcal.data.priors import Prior
from hdcal.data.records import Records
from hdcal.exported import jit
from hdcal.inference.distributions import frozen
from hdcal.inference.padding import pad_records
from hdcal.physics.chain import Base, Reading, predict_reading
from hdcal.physics.effect import Effect, parameters


def amplitude_units(
    records: Records,
    columns: np.ndarray,
    reading: Reading,
    effects: Sequence[type[Effect]],
    priors: Mapping[str, Prior],
    noise_sd: float,
) -> dict[str, float]:
    """Return the standard error of each half-normal amplitude near its null.

    Linear least squares with the base model: σ/‖P c‖ with c the derivative of the
    reading and P the projection off the base columns; never more than the prior sd.

    Args:
        records: the rows.
        columns: of the base model at the rows, from `linear_columns`, shape (n, 4).
        reading: how the rig reads.
        effects: effects in the model.
        priors: by site name.
        noise_sd: pilot noise [N].
    """
    slope = np.polyfit(records.deformation, records.force, 1)[0]
    base = Base(slope / reading.radial_per_read, 0.0, 0.0, 0.0, noise_sd)
    padded, units = pad_records(records), {}
    for effect in effects:
        own = {field: priors[f"{effect.name}.{field}"] for field in parameters(effect)}
        values = {
            field: float(_median(own[field], spec.null))
            for field, spec in parameters(effect).items()
        }
        widest = {
            field: float(prior.numbers[0])
            for field, prior in own.items()
            if prior.family == "half_normal"
        }
        slopes = {}
        if widest:
            slopes = _slopes(base, values, widest, padded, reading, effect=effect)
        for field, column in slopes.items():
            column = np.asarray(column)[: len(columns)]
            unit = finest(column, columns, noise_sd, widest[field])
            units[f"{effect.name}.{field}"] = unit
    return units


def finest(
    column: np.ndarray, columns: np.ndarray, noise_sd: float, widest: float
) -> float:
    """Return the standard error of an amplitude fitted with other parameters.

    Args:
        column: derivative of the mean reading by the amplitude, shape (n,).
        columns: derivatives by the other parameters, to any scale, shape (n, p).
        noise_sd: of the readings.
        widest: prior sd of the amplitude, which its error never exceeds.
    """
    fitted = columns @ np.linalg.lstsq(columns, column, rcond=None)[0]
    length = np.linalg.norm(column - fitted)
    unit = noise_sd / float(length) if length > 0.0 else widest
    return min(widest, unit) or widest


@jit(static_argnames=("effect",))
def _slopes(base: Base, values, prior_sds, records, reading, *, effect):
    """Return the derivative of the reading by each amplitude near its null."""

    def slope(field, sd):
        def mean(size):
            present = effect(**{**values, field: size})
            return predict_reading(base, (present,), records, reading)[0]

        # A tenth of the prior sd: at zero itself an effect may have no slope.
        return jax.jvp(mean, (sd / 10.0,), (1.0,))[1]

    return {field: slope(field, sd) for field, sd in prior_sds.items()}


def _median(prior: Prior, null: float | None) -> float:
    if null is not None:
        return null
    fixed = prior.family == "fixed"
    return float(prior.numbers[0]) if fixed else frozen(prior).median()
