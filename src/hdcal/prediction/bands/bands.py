"""Credible bands on the predicted force.

A prediction is an immediate reading: no time passes, so that leakage and other slow
effects have not begun.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import partial
from typing import Literal

import jax
import numpy as np

from hdcal.data.records import Records
from hdcal.errors import Finding, InputError
from hdcal.inference.density import build_effects, member_base
from hdcal.inference.posterior import Posterior
from hdcal.inference.problem import Problem, case_reading
from hdcal.physics.chain import predict_reading
from hdcal.physics.effect import Noise
from hdcal.prediction.forces import grid_records

Direction = Literal["up", "down"]
DIRECTIONS: tuple[Direction, ...] = ("up", "down")
_SENSE = {"up": 1.0, "down": -1.0}
# Rows predicted at a time: with 4000 draws a block takes 64 MB.
_BLOCK = 2000
_MOST_TEMPERATURES = 6
# How far beyond the data still counts as tested [K]: thermometers are no better.
_NEAR_K = 1.0


@dataclass(frozen=True)
class Bands:
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

    def columns(self) -> dict[str, np.ndarray]:
        """Return the columns in the order of bands.csv."""
        return {f.name: getattr(self, f.name) for f in fields(self)}


@jax.jit
def _predict_block(problem: Problem, values, records: Records, keys):
    """Return mean, mean with gap and a new reading: [draw, row] each."""
    gap = problem.discrepancy
    columns = None if gap is None else gap.columns(records.deformation)

    def one(value, key):
        of_run, of_specimen, of_noise = jax.random.split(key, 3)
        effects = build_effects(problem, value)
        base = member_base(problem, value)
        mean, noise = predict_reading(base, effects, records, problem.reading)
        other = _new_member(problem, value, of_run, of_specimen)
        base = member_base(problem, {**value, **other}, 0, 0)
        new, _ = predict_reading(base, effects, records, problem.reading)
        leftover = 0.0 if columns is None else columns @ value["gap_weights"]
        error = _reading_error(of_noise, noise, problem.step)
        return mean, mean + leftover, new + leftover + error

    return jax.vmap(one)(values, keys)


def _reading_error(key, noise: Noise, step):
    """Draw the error of a reading [N], the same quantile in every row.

    Bands are row by row, so that rows may share their random numbers; they are then
    smooth and do not depend on which other rows are asked for. Rounding is uniform
    over its step for the same reason.
    """
    pick, normal, rounding = jax.random.split(key, 3)
    sd = noise.sd[jax.random.categorical(pick, noise.log_weight)]
    uniform = jax.random.uniform(rounding, minval=-0.5, maxval=0.5)
    return sd * jax.random.normal(normal) + step * uniform


def _new_member(problem: Problem, value, of_run, of_specimen) -> dict:
    """Draw a run and a specimen that were not tested.

    Tested deviations are from the mean of the tested, so that a new one also carries
    the distance of that mean from the population's.
    """
    new = {}
    if problem.runs:
        sd = value["run_offset_sd"] * np.sqrt(1.0 + 1.0 / problem.runs)
        new["run_offset"] = sd * jax.random.normal(of_run, (1,))
    if problem.specimens:
        sd = value["specimen_sd"] * np.sqrt(1.0 + 1.0 / problem.specimens)
        new["specimen_deviation"] = sd * jax.random.normal(of_specimen, (1,))
    return new


def _check_grid(deformation, temperature, direction, interval) -> None:
    findings = []

    def find(name, problem, remedy):
        findings.append(Finding(name, problem, remedy))

    if deformation.size == 0 or not np.isfinite(deformation).all():
        find("--deformation", "is empty or not finite", "give numbers in mm")
    if temperature.size == 0 or not np.isfinite(temperature).all():
        find("--temperature", "is empty or not finite", "give numbers in °C")
    elif temperature.min() < -273.15:
        find("--temperature", "is below absolute zero", "give numbers in °C")
    if direction not in _SENSE:
        find("--direction", f"'{direction}' is unknown", "use up or down")
    if not 0.0 < interval < 1.0:
        find("--interval", f"{interval} is not between 0 and 1", "use e.g. 0.95")
    if findings:
        raise InputError(findings)


def _check_size(deformation, temperature, posterior: Posterior) -> None:
    """Refuse what is a slip of the unit, as the reader of the data does."""
    gear, findings = posterior.case.gear, []
    limit = gear.geometry.radius / case_reading(posterior.case).radial_per_read
    worst = float(np.max(np.abs(deformation)))
    if worst >= limit:
        problem = f"{worst:g} mm on a radius of {gear.geometry.radius:g} mm"
        findings.append(Finding("--deformation", problem, "Give it in mm"))
    rise = np.max(np.abs(temperature - gear.reference_temperature))
    if np.median(posterior.draws["alpha"]) * rise >= 0.5:
        problem = "the linear law E(T) would lose half of Young's modulus"
        findings.append(Finding("--temperature", problem, "Give it in °C"))
    if findings:
        raise InputError(findings)


def predict(
    posterior: Posterior,
    deformation: Sequence[float] | np.ndarray,
    temperature: Sequence[float] | np.ndarray | None = None,
    direction: Direction = "up",
    *,
    interval: float = 0.95,
    seed: int = 0,
    allow_failed: bool = False,
) -> Bands:
    """Predict the force at every pair of deformation and temperature.

    Args:
        posterior: from `calibrate` or `Posterior.load`.
        deformation: as read [mm], shape (n,).
        temperature: of the specimen [°C], shape (t,); by default the tested one
            nearest to the reference.
        direction: of the movement, for effects that depend on it.
        interval: probability inside the bands.
        seed: of the new measurements' noise.
        allow_failed: also for a posterior that failed; the rows then say so.

    Returns:
        Bands with t · n rows, deformation varying fastest.

    Raises:
        NotUsable: the posterior failed its checks.
        InputError: empty or non-finite input.
    """
    if not allow_failed:
        posterior.require_usable()
    gear = posterior.case.gear
    if temperature is None:
        measured = posterior.case.records.temperature
        temperature = [
            np.clip(gear.reference_temperature, np.min(measured), np.max(measured))
        ]
    along = np.atleast_1d(np.asarray(deformation, dtype=float))
    levels = np.atleast_1d(np.asarray(temperature, dtype=float))
    _check_grid(along, levels, direction, interval)
    _check_size(along, levels, posterior)
    at, warm = np.tile(along, len(levels)), np.repeat(levels, len(along))
    sense = np.full(len(at), _SENSE[direction])
    values = posterior.draws
    size = len(values["K"])
    tails = np.array([0.5 - interval / 2.0, 0.5, 0.5 + interval / 2.0])
    keys = jax.random.split(jax.random.key(seed), size)
    # A new reading is as good as the tested ones were on average.
    known_sd = float(np.sqrt(np.mean(posterior.case.records.force_sd**2)))
    blocks = []
    for start in range(0, len(at), _BLOCK):
        rows = slice(start, start + _BLOCK)
        records = grid_records(at[rows], warm[rows], sense[rows], known_sd)
        parts = _predict_block(posterior.problem, values, records, keys)
        blocks.append(np.stack([np.quantile(part, tails, axis=0) for part in parts]))
    physics, with_gap, new = np.concatenate(blocks, axis=2)
    if posterior.problem.discrepancy is None:
        with_gap = np.full_like(physics, np.nan)
    return Bands(
        at,
        warm,
        np.full(len(at), direction),
        *physics,
        *with_gap,
        *new,
        tested=_tested(posterior.case.records, at, warm, sense),
        usable=np.full(len(at), posterior.usable),
    )


def _tested(records: Records, deformation, temperature, sense) -> np.ndarray:
    def within(values, measured, slack):
        low, high = np.min(measured), np.max(measured)
        return (values >= low - slack) & (values <= high + slack)

    return (
        within(deformation, records.deformation, 1e-9)
        & within(temperature, records.temperature, _NEAR_K)
        & np.isin(sense, np.asarray(records.sense))
    )


def default_bands(posterior: Posterior, interval: float = 0.95) -> Bands:
    """Return the bands of a result folder: the tested range and a tenth beyond.

    One block per tested temperature (three over the range if there are many) and
    per direction that was tested.
    """
    records, gear = posterior.case.records, posterior.case.gear
    ends = [0.0, float(np.min(records.deformation)), float(np.max(records.deformation))]
    if gear.nominal_deformation is not None:
        ends.append(gear.nominal_deformation)
    low, high = min(ends), max(ends)
    beyond = 0.1 * (high - low)
    grid = np.linspace(low - (beyond if low < 0.0 else 0.0), high + beyond, 67)
    # The ends of the data themselves, so that the tested range shows whole.
    grid = np.union1d(grid, ends)
    # Rounded together, but never out of what was measured.
    levels = np.unique(
        np.clip(
            np.round(records.temperature, 1),
            np.min(records.temperature),
            np.max(records.temperature),
        )
    )
    if len(levels) > _MOST_TEMPERATURES:
        levels = np.linspace(levels[0], levels[-1], 3)
    make = partial(
        predict, posterior, grid, levels, interval=interval, allow_failed=True
    )
    sides: list[Direction] = [
        side for side in DIRECTIONS if _SENSE[side] in np.asarray(records.sense)
    ]
    parts = [make(side) for side in sides]
    joined = {
        f.name: np.concatenate([getattr(part, f.name) for part in parts])
        for f in fields(Bands)
    }
    return Bands(**joined)
