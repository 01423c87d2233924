"""Facts of a rig that sharpen priors: the table [rig]."""

import math
from dataclasses import replace
from typing import Annotated

import numpy as np
from pydantic import BaseModel

from hdcal.data.gear_file.validation import STRICT, within
from hdcal.data.prior import REFERENCE, FullScale, Prior
from hdcal.data.priors import effect_priors, rig_priors
from hdcal.screening.turning_points import TURN_MOST, rows_of_runs, turning_points

_PITCH_LOG_SD = 0.02  # of a pitch by its drawing
# Noise is what is faster than the loading: readings err alike over a fifth of a half
# cycle at most, so that each holds five independent stretches. Slower is a bend.
_FAST = 0.2
# How many correlated neighbours a filter stands for, and the prior of the correlation
# where it leaves hardly any.
_AS_GOOD_AS, _UNFILTERED = 20.0, (0.5, 1.5)


class RigTable(BaseModel):
    """The table [rig]; each fact sharpens a prior, none is needed."""

    model_config = STRICT
    load_cell_capacity_N: Annotated[float, within("load_cell_capacity")] | None = None
    gauge_range_mm: Annotated[float, within("size")] | None = None
    displacement_pitch_mm: Annotated[float, within("size")] | None = None
    filter_Hz: Annotated[float, within("filter")] | None = None


def rig_fact_priors(facts: RigTable, radial_per_read: float) -> dict[str, Prior]:
    """Return the effects' priors that a rig's facts sharpen, by `effect.parameter`.

    An error of a gauge is a share of its range, not of what was read of it.
    """
    priors, shipped = {}, effect_priors()

    def at_scale(name: str, scale: FullScale, source: str) -> None:
        priors[name] = replace(scale.own(shipped[name]), source=f"[rig] {source}")

    if capacity := facts.load_cell_capacity_N:
        scale = FullScale(capacity, REFERENCE.deformation)
        source = "load_cell_capacity_N: the shipped share, lost at capacity"
        at_scale("force_saturation.curvature", scale, source)
    if reach := facts.gauge_range_mm:
        scale = FullScale(REFERENCE.force, reach * radial_per_read)
        source = "gauge_range_mm: the shipped linearity error, of the range"
        at_scale("displacement_nonlinearity.curvature", scale, source)
    if pitch := facts.displacement_pitch_mm:
        numbers = (pitch * radial_per_read, _PITCH_LOG_SD)
        source = "[rig] displacement_pitch_mm"
        priors["screw_error.pitch"] = Prior("lognormal", numbers, "mm", source)
    return priors


def correlation_prior(
    cutoff: float | None,
    deformation: np.ndarray,
    run: np.ndarray,
    time: np.ndarray | None,
) -> Prior:
    """Return the prior of the correlation of neighbouring readings.

    White noise behind a filter of first order is correlated by e^(−2π f Δt). Where
    that is little nothing is known: other causes may correlate errors for longer.
    The cutoff f [Hz] is that of the rig's low-pass filter; time [s], shape (n,).
    """
    steps = np.diff(time) if cutoff is not None and time is not None else np.array([])
    if cutoff is not None and np.any(steps > 0.0):
        typical = float(np.median(steps[steps > 0.0]))
        likely = math.exp(-2.0 * math.pi * cutoff * typical)
        (a, b), known = _UNFILTERED, _AS_GOOD_AS * likely
        numbers = (a + known * likely, b + known * (1.0 - likely))
        return Prior("beta", numbers, "1", "[rig] filter_Hz, at the typical step")
    most = math.exp(-1.0 / (_FAST * rows_of_half_cycle(deformation, run)))
    return replace(rig_priors()["noise_correlation"], numbers=(0.0, most))


def rows_of_half_cycle(deformation: np.ndarray, run: np.ndarray) -> float:
    """Return the median number of rows between two turns of the loading."""
    lengths: list[int] = []
    for rows in rows_of_runs(run):
        x, span = deformation[rows], float(np.ptp(deformation[rows]))
        turns = turning_points(x, TURN_MOST * span)[0] if span > 0.0 else ()
        lengths += np.diff([0, *turns, len(x)]).tolist()
    return float(np.median(lengths))
