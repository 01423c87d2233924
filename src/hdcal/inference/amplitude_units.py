"""How finely the data see each amplitude: the unit of its sampling coordinate."""

from collections.abc import Mapping, Sequence

import jax
import numpy as np

from hdcal.data.priors import Prior
from hdcal.data.records import Records
from hdcal.inference.distributions import frozen
from hdcal.physics.chain import Base, Reading, linear_columns, predict_reading
from hdcal.physics.effect import Effect, parameters


def amplitude_units(
    records: Records,
    reading: Reading,
    effects: Sequence[type[Effect]],
    priors: Mapping[str, Prior],
    noise_sd: float,
) -> dict[str, float]:
    """Return the standard error of each half-normal amplitude near its null.

    Linear least squares beside the base model: σ/‖P c‖ with c the derivative of the
    reading and P the projection off the base columns; never more than the prior sd.

    Args:
        records: the rows.
        reading: how the rig reads.
        effects: effects in the model.
        priors: by site name.
        noise_sd: pilot noise [N].
    """
    columns = np.asarray(linear_columns(records, reading))
    slope = np.polyfit(records.deformation, records.force, 1)[0]
    base = Base(slope / reading.radial_per_read, 0.0, 0.0, 0.0, noise_sd)
    units = {}
    for effect in effects:
        values = {
            field: float(_median(priors[f"{effect.name}.{field}"], spec.null))
            for field, spec in parameters(effect).items()
        }
        for field in values:
            prior = priors[f"{effect.name}.{field}"]
            if prior.family != "half_normal":
                continue

            def mean(size, effect=effect, field=field, values=values):
                one = effect(**{**values, field: size})
                return predict_reading(base, (one,), records, reading)[0]

            # A tenth of the prior sd: at zero itself an effect may have no slope.
            near = float(prior.numbers[0]) / 10.0
            column = np.asarray(jax.jvp(mean, (near,), (1.0,))[1])
            fitted = columns @ np.linalg.lstsq(columns, column, rcond=None)[0]
            seen = np.linalg.norm(column - fitted)
            widest = float(prior.numbers[0])
            finest = noise_sd / seen if seen > 0.0 else widest
            units[f"{effect.name}.{field}"] = min(widest, finest) or widest
    return units


def _median(prior: Prior, null: float | None) -> float:
    if null is not None:
        return null
    return (
        float(prior.numbers[0]) if prior.family == "fixed" else frozen(prior).median()
    )
