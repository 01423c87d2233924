"""A dynamic calibration as a result: estimates, assumptions and bands of the record."""

from collections.abc import Mapping
from typing import Literal

import jax
import numpy as np
import pandas as pd
from pydantic import Field, computed_field

from hdcal.motion.charts import motion_chart
from hdcal.motion.dynamic_problem import (
    SITES,
    DynamicPosterior,
    DynamicProblem,
    predict_motion,
)
from hdcal.report.charts.chart_spec import Chart
from hdcal.report.charts.draws_charts import prior_chart
from hdcal.report.item import Interval, Words, quantity
from hdcal.report.posterior_result import (
    PARAMETER_NAMES,
    ParameterEstimate,
    PosteriorResult,
    posterior_fields,
)

_REQUIRED = {"required": ["K", "E0", *SITES], "propertyNames": {**PARAMETER_NAMES}}
# Draws of the bands; of long records fewer, to bound the numbers in memory.
_DRAWS, _FEWEST, _MOST_NUMBERS = 1000, 100, 50_000_000
_TAILS, _ROWS = (0.025, 0.5, 0.975), 10_000


class DynamicCalibration(PosteriorResult):
    """What `hdcal calibrate --dynamic` answers; summary.json.

    Damping and frequencies are at the mean temperature of the test; `bands` has a row
    per reading.
    """

    template = "motion/dynamic.md.j2"

    format: Literal["hdcal.dynamic-calibration/3"] = "hdcal.dynamic-calibration/3"
    parameters: dict[str, ParameterEstimate] = Field(json_schema_extra={**_REQUIRED})
    natural_frequency_Hz: Interval = quantity("natural frequency", "Hz")
    damped_frequency_Hz: Interval = quantity("frequency with damping", "Hz")
    damping_ratio: Interval = quantity("damping ratio ζ")
    damping_N_s_per_mm: Interval = quantity("damping c", "N·s/mm")
    bands: pd.DataFrame = Field(exclude=True)

    @computed_field
    @property
    def assumptions(self) -> tuple[Words, ...]:
        """Assumptions of the model, in sentences."""
        return self.lines("assumptions")

    def make_charts(self) -> Mapping[str, Chart]:
        """Return the record with bands, and priors."""
        return {
            "motion": motion_chart(self.bands),
            "priors": prior_chart(self.posterior),
        }


def dynamic_calibration_of(posterior: DynamicPosterior) -> DynamicCalibration:
    """Return a dynamic calibration as a result."""
    draws = posterior.draws
    ratio, frequency = draws["damping_ratio"], draws["natural_frequency"]
    damped = frequency * np.sqrt(np.maximum(1.0 - ratio**2, 0.0))
    return DynamicCalibration(
        **posterior_fields(posterior),
        natural_frequency_Hz=Interval.of(frequency),
        damped_frequency_Hz=Interval.of(damped),
        damping_ratio=Interval.of(ratio),
        damping_N_s_per_mm=Interval.of(draws["damping"]),
        bands=motion_bands(posterior),
    )


def motion_bands(posterior: DynamicPosterior, seed: int = 0) -> pd.DataFrame:
    """Return the record with equal-tailed 95 % bands, a row per reading."""
    problem, draws = posterior.moving, posterior.draws
    count = int(np.clip(_MOST_NUMBERS // problem.count, _FEWEST, _DRAWS))
    rows = np.linspace(0, len(draws["mass"]) - 1, count).astype(int)
    values = {name: each[rows] for name, each in draws.items()}
    real = slice(problem.count)
    mean = np.asarray(_each_motion(problem, values))[:, real]
    # The same quantile of the noise in all rows of a draw keeps the band smooth.
    noise = np.random.default_rng(seed).normal(0.0, values["deformation_sigma"])
    parts = np.array_split(mean, -(-mean.shape[1] // _ROWS), axis=1)
    each = [
        [np.quantile(draws, _TAILS, axis=0) for draws in (part, part + noise[:, None])]
        for part in parts
    ]
    (low, middle, high), (new_low, _, new_high) = np.concatenate(each, axis=2)
    return pd.DataFrame(
        {
            "time_s": problem.time[real],
            "force_N": problem.force[real],
            "deformation_mm": problem.deformation[real],
            "mean_lo_mm": low,
            "mean_median_mm": middle,
            "mean_hi_mm": high,
            "new_measurement_lo_mm": new_low,
            "new_measurement_hi_mm": new_high,
            "usable": posterior.usable,
        }
    )


@jax.jit
def _each_motion(problem: DynamicProblem, values):
    return jax.lax.map(lambda value: predict_motion(problem, value), values)
