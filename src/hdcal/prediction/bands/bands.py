"""Credible bands on the predicted force.

A prediction is an immediate reading: no time passes, so that leakage and other slow
effects have not begun.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from hdcal.data.plausible import implausible
from hdcal.data.records import Records, lies_far
from hdcal.errors import Finding, InputError
from hdcal.notebook import Shown
from hdcal.prediction.engine.causes import Cause, causes_of, likeliest
from hdcal.prediction.engine.conditions import (
    DIRECTIONS,
    SENSE,
    Direction,
    excluded_findings,
    far_findings,
    is_tested,
    temperature_findings,
    turning_point,
    usual_sd,
    usual_temperature,
)
from hdcal.prediction.engine.forces import grid_records
from hdcal.prediction.engine.mixture import draw_quantiles
from hdcal.prediction.engine.models import Models
from hdcal.prediction.engine.readings import readings
from hdcal.prediction.engine.untested import with_untested
from hdcal.quantities import FORCE, Quantities

# Rows predicted at a time: with 4000 draws a block takes 32 MB, on unloading 64 MB.
_BLOCK = 1000
_MOST_TEMPERATURES = 6
# A room that is logged: bands at its temperatures are one band [K].
_SAME_TEMPERATURE = 3.0


@dataclass(frozen=True, repr=False)
class Bands(Shown):
    """Equal-tailed bands of the force as read [N]; one entry per row.

    Attributes:
        deformation_mm: as read.
        temperature_C: of the specimen.
        direction: up or down.
        physics_lo_N: credible band of the mean reading: physics and effects.
        physics_median_N: its median.
        physics_hi_N: its upper end.
        with_gap_lo_N: credible band with the leftover discrepancy; NaN if not fitted.
        with_gap_median_N: its median.
        with_gap_hi_N: its upper end.
        new_measurement_lo_N: predictive band of one more reading, on a new run and a
            new specimen where these were fitted, with the rounding of the rig.
        new_measurement_median_N: its median.
        new_measurement_hi_N: its upper end.
        tested: deformation, temperature and direction lie within the data.
        usable: the calibration passed its checks.
        units: names and units of what was measured.
    """

    deformation_mm: np.ndarray
    temperature_C: np.ndarray
    direction: np.ndarray
    physics_lo_N: np.ndarray
    physics_median_N: np.ndarray
    physics_hi_N: np.ndarray
    with_gap_lo_N: np.ndarray
    with_gap_median_N: np.ndarray
    with_gap_hi_N: np.ndarray
    new_measurement_lo_N: np.ndarray
    new_measurement_median_N: np.ndarray
    new_measurement_hi_N: np.ndarray
    tested: np.ndarray
    usable: np.ndarray
    units: Quantities = FORCE

    def columns(self) -> dict[str, np.ndarray]:
        """Return the columns of bands.csv in their order."""
        return {self.units.key(name): getattr(self, name) for name in COLUMNS}


# Fields of `Bands` that are columns of bands.csv.
COLUMNS = tuple(field.name for field in fields(Bands) if field.name != "units")


def predict(
    posterior: Models,
    deformation: Sequence[float] | np.ndarray,
    temperature: Sequence[float] | np.ndarray | None = None,
    direction: Direction | None = None,
    *,
    interval: float = 0.95,
    seed: int = 0,
    allow_failed: bool = False,
) -> Bands:
    """Predict the force at every pair of deformation and temperature.

    Args:
        posterior: from `calibrate` or `Posterior.load`; or several, each with the
            probability of its model.
        deformation: as read [mm], shape (n,).
        temperature: of the specimen [°C], shape (t,); by default the tested one
            nearest to the reference.
        direction: of the movement, for effects that depend on it: up where the
            deformation rises, as read and with its sign; by default the one that
            loads the gear.
        interval: probability inside the bands.
        seed: of the new measurements' noise.
        allow_failed: also for a posterior that failed; the rows then say so.

    Returns:
        Bands with t · n rows, deformation varying fastest.

    Raises:
        NotUsable: the posterior failed its checks.
        InputError: empty or non-finite input.
    """
    causes = causes_of(posterior, allow_failed=allow_failed)
    case = causes[0].posterior.case
    warm = usual_temperature(case) if temperature is None else temperature
    along = _numbers("deformation", deformation)
    levels = _numbers("temperature", warm)
    _check(likeliest(causes), along, levels, direction, interval, seed)
    return _bands(causes, along, levels, direction, interval, seed)


def _numbers(name: str, given: Any) -> np.ndarray:
    """Return what was asked as an array of numbers, shape (n,)."""
    try:
        found = np.atleast_1d(np.asarray(given, dtype=float))
    except (TypeError, ValueError):
        found = np.zeros((0, 0))
    if found.ndim == 1:
        return found
    words = "is no list of numbers"
    remedy = "Give numbers one by one, as in [0.2, 0.4], or a column of a table"
    raise InputError([Finding(name, words, remedy)])


def _bands(
    causes: Sequence[Cause],
    along: np.ndarray,
    levels: np.ndarray,
    direction: Direction | None,
    interval: float,
    seed: int,
) -> Bands:
    """Return the bands at every pair of deformation and temperature."""
    case = causes[0].posterior.case
    at, warm = np.tile(along, len(levels)), np.repeat(levels, len(along))
    loading = _loading(at, case.records)
    sense = loading if direction is None else np.full(len(at), SENSE[direction])
    tails = np.array([0.5 - interval / 2.0, 0.5, 0.5 + interval / 2.0])
    models = [(cause.problem, *with_untested(cause, seed)) for cause in causes]
    blocks = []
    for start in range(0, len(at), _BLOCK):
        rows = slice(start, start + _BLOCK)
        path = _path(case.records, at[rows], warm[rows], sense[rows], loading[rows])
        found = _quantiles(causes, models, path, len(at[rows]), tails, seed)
        blocks.append(found)
    physics, with_gap, new = np.concatenate(blocks, axis=2)
    tested = is_tested(case.records, deformation=at, temperature=warm, sense=sense)
    usable = all(cause.posterior.usable for cause in causes)
    return Bands(
        at,
        warm,
        np.where(sense > 0.0, "up", "down"),
        *physics,
        *with_gap,
        *new,
        tested=tested,
        usable=np.full(len(at), usable),
        units=case.units,
    )


def _loading(at: np.ndarray, records: Records) -> np.ndarray:
    """Return the sense of loading of each row, +1 where the deformation rises."""
    # A gear at rest is loaded as the tested one was.
    tested = np.min(records.deformation) + np.max(records.deformation)
    return np.where(np.where(at == 0.0, tested, at) < 0.0, -1.0, 1.0)


def _path(tested: Records, at, warm, sense, loading) -> Records:
    """Return the readings, each of another gear, after where its unloading begins."""
    known_sd = usual_sd(tested)
    back = sense != loading
    if not back.any():
        return grid_records(at, warm, sense, known_sd)
    ends = np.min(tested.deformation), np.max(tested.deformation)
    begin = np.where(back, turning_point(at, loading, *ends), at)
    path, way = np.append(begin, at), np.append(loading, sense)
    gear = np.tile(np.arange(len(at)), 2)
    return grid_records(path, np.tile(warm, 2), way, known_sd, gear)


def _quantiles(causes: Sequence[Cause], models, path: Records, count: int, tails, seed):
    """Return quantiles of mean, mean with leftover and new reading: [3, 3, row].

    Args:
        causes: over which to average.
        models: of each cause its problem, its draws and what they leave open.
        path: rows, of which the last are asked for.
        count: of those asked for.
        tails: probabilities of the quantiles.
        seed: of the new reading.
    """
    parts = []
    for model in models:
        parts.append(readings(*model, path, seed))
    tables = [np.concatenate(kind)[:, -count:] for kind in zip(*parts, strict=True)]
    if len(causes) == 1:
        found = [np.quantile(table, tails, axis=0) for table in tables]
    else:
        weights = np.concatenate([cause.weights for cause in causes])
        found = [draw_quantiles(table, weights, tails) for table in tables]
    if all(cause.problem.discrepancy is None for cause in causes):
        found[1] = np.full_like(found[1], np.nan)
    return np.stack(found)


def _check(cause: Cause, deformation, temperature, direction, interval, seed) -> None:
    """Refuse what cannot be asked, slips of the unit as the data's reader does."""
    case, findings = cause.posterior.case, []
    gear, tested = case.gear, case.records.deformation
    unit = case.units.displacement_unit

    def find(name, problem, remedy):
        findings.append(Finding(name, problem, remedy))

    if deformation.size == 0:
        find("deformation", "is empty", f"give numbers in {unit}")
    elif wrong := implausible("deformation", deformation, case.units.displacement):
        findings += wrong
    elif (worst := float(np.max(np.abs(deformation)))) >= gear.reach:
        problem = f"{worst:g} mm on a radius of {gear.geometry.radius:g} mm"
        find("deformation", problem, "Give it in mm")
    else:
        findings += far_findings(worst, float(np.max(np.abs(tested))), unit=unit)
        sense = SENSE.get(direction, _loading(deformation, case.records))
        pairs = np.broadcast(deformation, sense)
        each = (excluded_findings(case, *pair) for pair in pairs)
        findings += next(filter(None, each), [])
    if temperature.size == 0:
        find("temperature", "is empty", "give numbers in °C")
    else:
        findings += temperature_findings(gear, cause.values, temperature)
    if direction not in (None, *DIRECTIONS):
        find("direction", f"'{direction}' is unknown", "use up or down")
    findings += implausible("interval", interval) + implausible("seed", seed)
    if findings:
        raise InputError(findings)


def default_bands(models: Models, interval: float = 0.95) -> Bands:
    """Return the bands of a result folder: the tested range and a tenth beyond.

    One block per tested temperature (three over the range if there are many, one of
    a room's) and per direction that was tested.

    Args:
        models: a posterior, or several with probabilities, over which bands average.
        interval: probability inside the bands.
    """
    case = causes_of(models, allow_failed=True)[0].posterior.case
    records, nominal = case.records, case.gear.nominal_deformation
    ends = [float(np.min(records.deformation)), float(np.max(records.deformation))]
    ends += [] if lies_far(records) else [0.0]
    ends += [] if nominal is None else [nominal]
    low, high = min(ends), max(ends)
    beyond = 0.1 * (high - low)
    # Not beyond an end that is the unloaded gear and no tested deformation.
    low, high = low - beyond * float(low != 0.0), high + beyond * float(high != 0.0)
    for left, right in case.excluded:
        low, high = (low, left) if left >= ends[1] else (right, high)
    ends = [end for end in ends if low <= end <= high]
    # With the ends of the data themselves, so that the tested range shows whole.
    grid = np.union1d(np.linspace(low, high, 67), ends)
    cold, warm = np.min(records.temperature), np.max(records.temperature)
    # Rounded together, but never out of what was measured.
    levels = np.unique(np.clip(np.round(records.temperature, 1), cold, warm))
    three = np.linspace(levels[0], levels[-1], 3)
    if warm - cold < _SAME_TEMPERATURE:
        levels = three[1:2]
    elif len(levels) > _MOST_TEMPERATURES:
        levels = three
    parts = [
        predict(models, grid, levels, side, interval=interval, allow_failed=True)
        for side in DIRECTIONS
        if SENSE[side] in np.asarray(records.sense)
        and SENSE[side] != case.excluded_sense
    ]
    tables = {n: np.concatenate([getattr(p, n) for p in parts]) for n in COLUMNS}
    return Bands(**tables, units=case.units)
