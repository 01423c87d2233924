"""From a case to the linear rows on which every hypothesis is compared."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
from jaxtyping import Bool

from hdcal.data.case import Case
from hdcal.data.gear_file.certificates import GAINS
from hdcal.data.priors import Prior
from hdcal.data.records import Array, Records
from hdcal.evidence.effect_curves import base_reading
from hdcal.evidence.linear_rows import CORRELATIONS, LinearRows
from hdcal.evidence.row_features import (
    half_cycles,
    place_in_run,
    scale_to_unit,
    take_rows,
)
from hdcal.inference import distributions
from hdcal.inference.noise_form import pilot_fit
from hdcal.inference.problem import case_reading, problem_priors
from hdcal.inference.serial_correlation import previous_rows
from hdcal.physics.chain import Base, Reading
from hdcal.physics.theory import THEORIES

# Noise below this share of the largest force is taken as this.
_LEAST_NOISE = 1e-6
# Noise may err alike over a fifth of a half cycle: what lasts longer is physics.
_SPANS, _LARGEST = 5.0, 0.98
# Below this the coefficients that are always there reach far enough.
_WORTHWHILE = 0.75
# Place of the loss of modulus among the base columns.
MODULUS_LOSS = 2


@dataclass(frozen=True)
class PreparedCase:
    """One case, linearised about a first fit of the base model.

    Attributes:
        records: rows, run after run.
        order: index in the case of each of these rows.
        reading: how the rig reads.
        base: the force model about which effects act.
        rows: readings and base columns.
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
    rows: LinearRows
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


def prepare(
    case: Case,
    priors: Mapping[str, Prior],
    noise_sd: float | None = None,
    stiffness: float | None = None,
) -> PreparedCase:
    """Linearise a case.

    Args:
        case: gear and records.
        priors: of the library's effects, by site name.
        noise_sd: of a reading [N]; by default a pilot estimate.
        stiffness: about which effects act [N/mm]; by default from least squares.
    """
    order = np.argsort(np.asarray(case.records.run), kind="stable")
    records = take_rows(case.records, order)
    reading = case_reading(case)
    own = problem_priors(case, (), {}, case.gear.theory)
    # Computed readings have no noise, and a noise of zero has no density.
    least = _LEAST_NOISE * float(np.max(np.abs(records.force)))
    least = max(least, case.gear.force_resolution / np.sqrt(12.0))
    noise_sd = float(noise_sd or max(pilot_fit(records).noise_sd, least))
    scale = stiffness_prior(case, own)
    base, columns, mean = _linearise(records, reading, own, scale, noise_sd, stiffness)
    relative = np.sqrt(1.0 + (np.asarray(records.force_sd) / noise_sd) ** 2)
    rows = LinearRows(
        reading=np.asarray(records.force) - mean,
        base=columns,
        # Columns are in units of the prior sd of their coefficients.
        precision=np.full(columns.shape[1], noise_sd**2),
        before=previous_rows(records),
        weight=1.0 / relative,
        correlations=_correlations(records),
        tolerance=tolerance_functions(records),
    )
    table = {**priors, **case.gear.effect_priors, **case.gear.scale_priors, **own}
    return PreparedCase(records, order, reading, base, rows, noise_sd, table, *scale)


def _correlations(records: Records) -> np.ndarray:
    """Return the AR(1) coefficients that are integrated over.

    A rig that is read often errs alike for many rows and for a small part of a stroke:
    two further coefficients then reach up to that part.
    """
    rows = float(np.median(np.bincount(half_cycles(records))))
    longest = min(np.exp(-_SPANS / rows), _LARGEST)
    if longest < _WORTHWHILE:
        return np.array(CORRELATIONS)
    # Half-way between time constants, as they multiply.
    ends = np.log([CORRELATIONS[-1], longest])
    middle = np.exp(-np.sqrt(ends[0] * ends[1]))
    return np.array([*CORRELATIONS, middle, longest])


def log_moments(prior: Prior, name: str = "") -> tuple[float, float]:
    """Return mean and sd of the logarithm of a positive parameter."""
    if prior.family == "lognormal":
        return float(np.log(prior.numbers[0])), float(prior.numbers[1])
    mean, sd = moments(prior, name)
    return float(np.log(mean)), sd / mean


def moments(prior: Prior, name: str = "") -> tuple[float, float]:
    """Return mean and sd of a parameter; one that is fixed has a very small sd."""
    mean, sd = distributions.moments(prior, name)
    return mean, 1e-9 if prior.family == "fixed" else sd


def stiffness_prior(case: Case, priors) -> tuple[float, float, float, float]:
    """Return mean and sd of the log stiffness, and both formulas with K = 1 [N/mm]."""
    k_mean, k_sd = log_moments(priors["K"])
    e_mean, e_sd = log_moments(priors["E0"], "E0")
    modulus = np.exp(e_mean)
    nominal, ring = (
        float(THEORIES[theory](case.gear.geometry, modulus))
        for theory in (case.gear.theory, "ring")
    )
    # The stiffness as read has the gains in it.
    gains = [moments(priors[name])[1] for name in GAINS if name in priors]
    sd = float(reduce(np.hypot, [k_sd, e_sd, *gains]))
    return k_mean + float(np.log(nominal)), sd, nominal, ring


def _linearise(
    records: Records, reading: Reading, priors, scale, noise_sd: float, stiffness
):
    """Return base, columns in units of the prior sds, and prior mean of the readings.

    The stiffness is expanded about its least-squares value, where effects act; its
    own prior is on the logarithm.
    """
    alpha, _ = moments(priors["alpha"])
    zero, _ = moments(priors["deformation_offset"])
    offset, _ = moments(priors["force_offset"])
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
    columns = _columns(records, reading, priors, base, expected_sd)
    mean = base_reading(base, records, reading)
    mean = mean + stiffness * shape * (expected - np.log(stiffness))
    return base, columns, mean


def _columns(records: Records, reading: Reading, priors, base: Base, log_sd: float):
    """Return what one prior sd of each base parameter adds [N], shape (n, 4)."""
    alpha, alpha_sd = moments(priors["alpha"])
    zero, zero_sd = moments(priors["deformation_offset"])
    rise = np.asarray(records.temperature) - reading.reference_temperature
    radial = (np.asarray(records.deformation) - zero) * reading.radial_per_read
    soft = 1.0 - alpha * rise
    return np.stack(
        [
            log_sd * base.stiffness * radial * soft,
            np.full(len(rise), moments(priors["force_offset"])[1]),
            -alpha_sd * base.stiffness * rise * radial,
            -zero_sd * base.stiffness * reading.radial_per_read * soft,
        ],
        axis=1,
    )


def tolerance_functions(records: Records) -> np.ndarray:
    """Return smooth functions of what the rig varies, shape (j, n).

    Together of unit mean square: the relative sd of a shape at a typical row.
    """
    x = scale_to_unit(records.deformation)
    t = place_in_run(records.run)
    parts = [np.cos(np.pi * k * (x + 1.0) / 2.0) for k in (1, 2, 3)]
    parts += [np.cos(np.pi * k * (t + 1.0) / 2.0) for k in (1, 2)]
    parts.append(np.asarray(records.sense, float))
    # A law of temperature or of rate may bend.
    parts += [
        scale_to_unit(records.temperature),
        scale_to_unit(np.abs(records.rate)),
    ]
    table = np.stack(parts)
    return table / np.sqrt(np.sum(np.mean(table**2, axis=1)))


def with_relative_noise(case: PreparedCase, relative_sd: Array) -> PreparedCase:
    """Return the case with another noise sd in each row, relative to σ."""
    weight = np.asarray(case.rows.weight) / np.asarray(relative_sd)
    return replace(case, rows=replace(case.rows, weight=weight))


def with_rows(case: PreparedCase, kept: Bool[np.ndarray, " n"]) -> PreparedCase:
    """Return the case as if only these of its rows had been read."""
    rows, run = case.rows, np.cumsum(case.rows.before < 0)[kept]
    left = replace(
        rows,
        reading=rows.reading[kept],
        base=rows.base[kept],
        before=np.where(np.diff(run, prepend=0) == 0, np.arange(len(run)) - 1, -1),
        weight=np.asarray(rows.weight)[kept],
        tolerance=rows.tolerance[:, kept],
    )
    records = take_rows(case.records, np.flatnonzero(kept))
    return replace(case, records=records, order=case.order[kept], rows=left)
