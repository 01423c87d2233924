"""From a case to the rows that every hypothesis is judged on."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import jax
import numpy as np

from hdcal.data.case import Case
from hdcal.data.priors import Prior
from hdcal.data.records import Array, Records
from hdcal.evidence.whitened_rows import CORRELATIONS, Rows
from hdcal.inference.distributions import frozen
from hdcal.inference.problem import case_reading, pilot_noise, problem_priors
from hdcal.physics.chain import Base, Reading, predict_reading
from hdcal.physics.theory import THEORIES

# Noise below this share of the largest force is taken as this.
_LEAST_NOISE = 1e-6


@dataclass(frozen=True)
class Setting:
    """One case, laid out for evidences.

    Attributes:
        records: rows, run after run.
        order: index in the case of each of these rows.
        reading: how the rig reads.
        base: the force model about which effects act.
        rows: what the evidence needs.
        noise_sd: pilot estimate [N].
        priors: of every parameter by site name.
        log_stiffness: prior mean of the log stiffness [log N/mm].
        log_stiffness_sd: its prior sd; the unit of the first base column.
        nominal: stiffness of the gear's own formula with K = 1 [N/mm].
        ring: stiffness of the ring formula with K = 1 [N/mm].
    """

    records: Records
    order: np.ndarray
    reading: Reading
    base: Base
    rows: Rows
    noise_sd: float
    priors: dict[str, Prior]
    log_stiffness: float
    log_stiffness_sd: float
    nominal: float
    ring: float

    def base_columns(self, records: Records) -> np.ndarray:
        """Return the base columns of other rows of the same rig, shape (n, p)."""
        return _columns(
            records, self.reading, self.priors, self.base, self.log_stiffness_sd
        )

    def base_mean(self, records: Records) -> np.ndarray:
        """Return the prior mean of the readings of other rows [N], shape (n,)."""
        mean, _ = predict_reading(self.base, (), records, self.reading)
        shift = self.log_stiffness - np.log(self.base.stiffness)
        own = self.base_columns(records)[:, 0] / self.log_stiffness_sd
        return np.asarray(mean) + own * shift


def lay_out(
    case: Case,
    priors: Mapping[str, Prior],
    noise_sd: float | None = None,
    stiffness: float | None = None,
) -> Setting:
    """Lay a case out for evidences.

    Args:
        case: gear and records.
        priors: of the library's effects, by site name.
        noise_sd: of a reading [N]; by default a pilot estimate.
        stiffness: about which effects act [N/mm]; by default from least squares.
    """
    order = np.argsort(np.asarray(case.records.run), kind="stable")
    records = take(case.records, order)
    reading = case_reading(case)
    own = problem_priors(case, (), {}, case.gear.theory)
    # Computed readings have no noise; nothing can be weighed against none at all.
    least = _LEAST_NOISE * float(np.max(np.abs(records.force)))
    noise_sd = noise_sd or max(pilot_noise(records), least)
    scale = _scale(case, own)
    base, columns, mean = _base(records, reading, own, scale, noise_sd, stiffness)
    relative = np.sqrt(1.0 + (np.asarray(records.force_sd) / noise_sd) ** 2)
    rows = Rows(
        reading=np.asarray(records.force) - mean,
        base=columns,
        # Columns are in units of the prior sd of their coefficients.
        precision=np.full(columns.shape[1], noise_sd**2),
        before=rows_before(np.asarray(records.run)),
        weight=1.0 / relative,
        correlations=np.array(CORRELATIONS),
        tolerance=tolerance_functions(records),
    )
    table = {**priors, **case.gear.effect_priors, **case.gear.scale_priors, **own}
    return Setting(records, order, reading, base, rows, noise_sd, table, *scale)


def take(records: Records, rows) -> Records:
    """Return some rows of the records, features as they were."""
    return jax.tree.map(lambda column: np.asarray(column)[rows], records)


def rows_before(run: np.ndarray) -> np.ndarray:
    """Return the index of the row before in the same run, −1 for a run's first."""
    before = np.arange(len(run)) - 1
    return np.where(np.diff(run, prepend=run[0] - 1) != 0, -1, before)


def _moments(prior: Prior) -> tuple[float, float]:
    if prior.family == "fixed":
        return float(prior.numbers[0]), 1e-9
    law = frozen(prior)
    return float(law.mean()), float(law.std())


def _log_moments(prior: Prior) -> tuple[float, float]:
    if prior.family == "lognormal":
        return float(np.log(prior.numbers[0])), float(prior.numbers[1])
    mean, sd = _moments(prior)
    return float(np.log(mean)), sd / mean


def _scale(case: Case, priors) -> tuple[float, float, float, float]:
    """Return mean and sd of the log stiffness, and both formulas with K = 1 [N/mm]."""
    k_mean, k_sd = _log_moments(priors["K"])
    e_mean, e_sd = _log_moments(priors["E0"])
    modulus = np.exp(e_mean)
    nominal, ring = (
        float(THEORIES[theory](case.gear.geometry, modulus))
        for theory in (case.gear.theory, "ring")
    )
    return k_mean + float(np.log(nominal)), float(np.hypot(k_sd, e_sd)), nominal, ring


def _base(
    records: Records, reading: Reading, priors, scale, noise_sd: float, stiffness
):
    """Return base, columns in units of the prior sds, and prior mean of the readings.

    The stiffness is expanded about its least-squares value, where effects act; its
    own prior is on the logarithm.
    """
    alpha, _ = _moments(priors["alpha"])
    zero, _ = _moments(priors["deformation_offset"])
    offset, _ = _moments(priors["force_offset"])
    shape = (records.deformation - zero) * reading.radial_per_read
    rise = np.asarray(records.temperature) - reading.reference_temperature
    shape = shape * (1.0 - alpha * rise)
    design = np.stack([shape, np.ones_like(shape)], axis=1)
    if stiffness is None:
        stiffness = float(np.linalg.lstsq(design, records.force, rcond=None)[0][0])
    expected, expected_sd = scale[:2]
    # A measured slope that is not positive says nothing about effects on stiffness.
    stiffness = stiffness if stiffness > 0.0 else float(np.exp(expected))
    base = Base(stiffness, alpha, zero, offset, noise_sd)
    mean, _ = predict_reading(base, (), records, reading)
    columns = _columns(records, reading, priors, base, expected_sd)
    mean = np.asarray(mean) + stiffness * shape * (expected - np.log(stiffness))
    return base, columns, mean


def _columns(records: Records, reading: Reading, priors, base: Base, log_sd: float):
    """Return what one prior sd of each base parameter adds [N], shape (n, 4)."""
    alpha, alpha_sd = _moments(priors["alpha"])
    zero, zero_sd = _moments(priors["deformation_offset"])
    rise = np.asarray(records.temperature) - reading.reference_temperature
    radial = (np.asarray(records.deformation) - zero) * reading.radial_per_read
    soft = 1.0 - alpha * rise
    return np.stack(
        [
            log_sd * base.stiffness * radial * soft,
            np.full(len(rise), _moments(priors["force_offset"])[1]),
            -alpha_sd * base.stiffness * rise * radial,
            -zero_sd * base.stiffness * reading.radial_per_read * soft,
        ],
        axis=1,
    )


def tolerance_functions(records: Records) -> np.ndarray:
    """Return smooth functions of what the rig varies, shape (j, n).

    Together of unit mean square: the relative sd of a shape at a typical row.
    """
    x = spread_out(records.deformation)
    t = within_run(records.run)
    parts = [np.cos(np.pi * k * (x + 1.0) / 2.0) for k in (1, 2, 3)]
    parts += [np.cos(np.pi * k * (t + 1.0) / 2.0) for k in (1, 2)]
    parts.append(np.asarray(records.sense, float))
    # A law of temperature or of rate may bend.
    parts += [spread_out(records.temperature), spread_out(np.abs(records.rate))]
    table = np.stack(parts)
    return table / np.sqrt(np.sum(np.mean(table**2, axis=1)))


def spread_out(values) -> np.ndarray:
    """Return values scaled to −1 … 1; zeros where they are all the same."""
    values = np.asarray(values, float)
    low, high = values.min(), values.max()
    return (2.0 * values - low - high) / (high - low) if high > low else 0.0 * values


def within_run(run) -> np.ndarray:
    """Return the place of each row in its run, −1 … 1; runs are contiguous."""
    run = np.asarray(run)
    place = np.zeros(len(run))
    for rows in np.split(np.arange(len(run)), np.flatnonzero(np.diff(run)) + 1):
        place[rows] = np.linspace(-1.0, 1.0, len(rows)) if len(rows) > 1 else 0.0
    return place


def reweighted(setting: Setting, relative_sd: Array) -> Setting:
    """Return the setting with another noise sd in each row, relative to σ."""
    rows = setting.rows
    return replace(
        setting, rows=replace(rows, weight=np.asarray(rows.weight) / relative_sd)
    )
