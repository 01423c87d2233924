"""A case as a linear problem about a first fit of the base model.

y = X b + effects + remainder + noise with b ~ N(0, 1). The base model and its priors
are those of the calibration; the log stiffness is expanded about a fitted value.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import jax
import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.linalg import cho_solve

from hdcal.data.case import Case
from hdcal.data.gear_file.certificates import GAINS
from hdcal.data.prior import Prior
from hdcal.data.priors import effect_priors
from hdcal.data.records import Records
from hdcal.data.scatter import left_of_lines
from hdcal.evidence.covariates import noise_correlations, tolerance_functions
from hdcal.evidence.effect_curves import padded_records
from hdcal.evidence.row_features import take_rows
from hdcal.inference import distributions, serial_correlation
from hdcal.inference.noise_form import pilot_fit
from hdcal.inference.problem import case_reading, problem_priors
from hdcal.physics.chain import Base, Reading
from hdcal.physics.effect import Effect
from hdcal.physics.theory import THEORIES

# Least noise sd as a share of the largest force: computed readings have no noise.
_LEAST_NOISE = 1e-6
# Numbers that are whitened at a time.
_AT_HAND = 2**16
# Prior sd of a fixed parameter.
_FIXED = 1e-9


@dataclass(frozen=True)
class LinearProblem:
    """Rows of one case with the columns of its base model.

    Attributes:
        records: rows, run after run.
        reading: how the rig reads.
        base: parameters about which effects are evaluated.
        priors: by site name.
        y: force less the prior mean of the base model [N].
        X: columns of the base model [N per prior sd].
        noise_sd: reference noise sd [N]; the prior sds of b are multiplied by the noise
            sd over this one, which keeps the noise sd a scale of the whole problem.
        before: index of the row before in the same run, −1 for a run's first.
        weight: one over the relative noise sd that the file states for each row.
        correlations: AR(1) coefficients of the noise.
        tolerance: smooth functions by which an effect's shape may deviate.
        log_shift: prior mean of the log stiffness less that of `base`.
        log_sd: prior sd of the log stiffness.
        offsets: number of columns of X that are offsets of runs; their priors are so
            wide that each takes a row.
    """

    records: Records
    reading: Reading
    base: Base
    priors: dict[str, Prior]
    y: Float[np.ndarray, " n"]
    X: Float[np.ndarray, "n p"]
    noise_sd: float
    before: Int[np.ndarray, " n"]
    weight: Float[np.ndarray, " n"]
    correlations: Float[np.ndarray, " r"]
    tolerance: Float[np.ndarray, "j n"]
    log_shift: float
    log_sd: float
    offsets: int = 0

    @cached_property
    def padded(self) -> Records:
        """The records as arrays of JAX, padded to a length that many cases share."""
        return jax.device_put(padded_records(self.records))

    @cached_property
    def root(self) -> Float[np.ndarray, "p p"]:
        """The upper triangular R with R'R = X'X + noise_sd² I."""
        held = self.noise_sd * np.eye(self.X.shape[1])
        return np.linalg.qr(np.vstack([self.X, held])).R

    @cached_property
    def noise_prior(self) -> Any:
        """The prior of the noise sd, as a frozen SciPy distribution."""
        return distributions.frozen(self.priors["sigma"], "sigma")

    def project(self, curves: Float[np.ndarray, "*g n"]) -> Float[np.ndarray, "*g n"]:
        """Return the part of curves that the base model leaves under its priors."""
        return curves - (curves @ self.X) @ cho_solve((self.root, False), self.X.T)

    def whiten(
        self, curves: Float[np.ndarray, "*g n"], weight, correlation: float
    ) -> Float[np.ndarray, "*g n"]:
        """Return curves in which the noise is independent and of equal sd.

        Args:
            curves: rows along the last axis.
            weight: one over the relative noise sd of each row, shape (n,).
            correlation: AR(1) coefficient of the noise.
        """
        if correlation == 0.0:
            return curves * weight
        # As `serial_correlation.whiten` does, a few curves at a time: of long records
        # they are larger than what a processor keeps at hand.
        follows = self.before >= 0
        gain = (1.0 - correlation**2) ** -0.5
        scale = weight * np.where(follows, gain, 1.0)
        tied = weight[self.before] * np.where(follows, correlation * gain, 0.0)
        table = curves.reshape(-1, curves.shape[-1])
        white, step = np.empty_like(table), max(1, _AT_HAND // len(weight))
        for start in range(0, len(table), step):
            few, found = table[start : start + step], white[start : start + step]
            np.multiply(few, scale, out=found)
            if self._in_order:
                found[:, 1:] -= few[:, :-1] * tied[1:]
            else:
                found -= few[:, self.before] * tied
        return white.reshape(curves.shape)

    @cached_property
    def _in_order(self) -> bool:
        """Whether the row before one in its run is the row above it, if any is."""
        follows = np.flatnonzero(self.before >= 0)
        return bool(np.all(self.before[follows] == follows - 1))

    @property
    def count(self) -> int:
        """Number of rows that count: not left out, nor used up by offsets of runs."""
        return int(np.count_nonzero(self.weight)) - self.offsets

    def without(self, left_out: Bool[np.ndarray, " n"]) -> "LinearProblem":
        """Return the problem in which some rows tell nothing."""
        gone = left_out | (left_out[self.before] & (self.before >= 0))
        return replace(
            self,
            weight=np.where(left_out, 0.0, self.weight),
            before=np.where(gone, -1, self.before),
        )

    def with_columns(
        self, offset: Float[np.ndarray, " n"], columns: Float[np.ndarray, "c n"]
    ) -> "LinearProblem":
        """Return the problem whose base also has an offset and Gaussian columns."""
        X = np.concatenate([self.X, columns.T], axis=1)
        return replace(self, y=self.y - offset, X=X)


@dataclass(frozen=True)
class Expansion:
    """The point about which a case is made linear; a None is estimated.

    Attributes:
        noise_sd: reference noise sd [N].
        stiffness: about which effects are evaluated [N/mm].
    """

    noise_sd: float | None = None
    stiffness: float | None = None


def linear_problem(
    case: Case,
    library: Mapping[str, type[Effect]],
    about: Expansion | None = None,
    *,
    free_runs: bool = False,
) -> LinearProblem:
    """Return the linear problem of a case.

    Args:
        case: gear and records.
        library: effects whose priors are wanted, by name.
        about: the point of expansion; by default estimated.
        free_runs: whether each run has an unknown force offset.

    Raises:
        InputError: an effect has no prior.
    """
    about = about or Expansion()
    order = np.argsort(np.asarray(case.records.run), kind="stable")
    records, reading = take_rows(case.records, order), case_reading(case)
    shipped, effects = effect_priors(case.gear.full_scale), [*library.values()]
    own = problem_priors(case, effects, shipped, case.gear.theory)
    # Those of scatter are sites of no problem.
    priors = shipped | case.gear.effect_priors | own
    least = _LEAST_NOISE * float(np.max(np.abs(records.force)))
    least = max(least, case.gear.force_resolution / np.sqrt(12.0))
    noise_sd = float(max(about.noise_sd or _noise_sd(records, least), least))
    log_mean, log_sd, _ = stiffness_prior(case, priors)
    base = _base(records, reading, priors, noise_sd, about.stiffness, np.exp(log_mean))
    columns = base_columns(records, reading, priors, base, log_sd)
    log_shift = log_mean - float(np.log(float(base.stiffness)))
    mean = base.force_offset + columns[:, 0] / log_sd * (1.0 + log_shift)
    offsets = run_columns(records) if free_runs else np.zeros((len(mean), 0))
    return LinearProblem(
        records=records,
        reading=reading,
        base=base,
        priors=priors,
        y=np.asarray(records.force) - mean,
        X=np.hstack([columns, offsets]),
        offsets=offsets.shape[1],
        noise_sd=noise_sd,
        before=serial_correlation.previous_rows(records),
        weight=1.0 / np.sqrt(1.0 + (np.asarray(records.force_sd) / noise_sd) ** 2),
        correlations=noise_correlations(records),
        tolerance=tolerance_functions(records),
        log_shift=log_shift,
        log_sd=log_sd,
    )


def _noise_sd(records: Records, least: float) -> float:
    """Return a first estimate of the noise sd [N].

    The pilot fit passes through few rows exactly; then a straight line gives it.
    """
    found = pilot_fit(records).noise_sd
    if found > least:
        return found
    left = left_of_lines(records, np.asarray(records.force))
    lines = len(np.unique(records.run)) + len(np.unique(records.specimen))
    return float(np.sqrt(left @ left / max(len(left) - lines, 1)))


def moments(priors: Mapping[str, Prior], name: str) -> tuple[float, float]:
    """Return mean and sd of a parameter; that of a fixed one is tiny."""
    mean, sd = distributions.moments(priors[name], name)
    return mean, sd or _FIXED


def _log_moments(priors: Mapping[str, Prior], name: str) -> tuple[float, float]:
    """Return mean and sd of the logarithm of a positive parameter."""
    prior = priors[name]
    if prior.family == "lognormal":
        return float(np.log(prior.numbers[0])), float(prior.numbers[1])
    mean, sd = moments(priors, name)
    return float(np.log(mean)), sd / mean


def stiffness_prior(
    case: Case, priors: Mapping[str, Prior]
) -> tuple[float, float, float]:
    """Return the prior of the log stiffness as read, gauge gains included.

    Returns:
        Its mean and sd [log N/mm], and the stiffness at K = 1 [N/mm].
    """
    (log_k, k_sd), (log_e, e_sd) = (_log_moments(priors, name) for name in ("K", "E0"))
    formula = float(THEORIES[case.gear.theory](case.gear.geometry, np.exp(log_e)))
    gains = [moments(priors, name)[1] for name in GAINS if name in priors]
    sd = float(np.linalg.norm([k_sd, e_sd, *gains]))
    return log_k + float(np.log(formula)), sd, formula


def _base(
    records: Records,
    reading: Reading,
    priors: Mapping[str, Prior],
    noise_sd: float,
    stiffness: float | None,
    expected: float,
) -> Base:
    """Return the base parameters, the stiffness by least squares unless given.

    Args:
        records: the rows.
        reading: how the rig reads.
        priors: by site name.
        noise_sd: of a reading [N].
        stiffness: to use [N/mm].
        expected: stiffness in place of one that is not positive [N/mm].
    """
    names = ("alpha", "deformation_offset", "force_offset")
    alpha, zero, offset = (moments(priors, name)[0] for name in names)
    if stiffness is None:
        rise = np.asarray(records.temperature) - reading.reference_temperature
        radial = (np.asarray(records.deformation) - zero) * reading.radial_per_read
        shape = radial * (1.0 - alpha * rise)
        design = np.stack([shape, np.ones_like(shape)], axis=1)
        force = np.asarray(records.force)
        stiffness = float(np.linalg.lstsq(design, force, rcond=None)[0][0])
    stiffness = stiffness if stiffness > 0.0 else float(expected)
    return Base(stiffness, alpha, zero, offset, noise_sd)


def base_columns(
    records: Records,
    reading: Reading,
    priors: Mapping[str, Prior],
    base: Base,
    log_sd: float,
) -> Float[np.ndarray, "n 4"]:
    """Return the change of each row by one prior sd of each base parameter [N]."""
    rise = np.asarray(records.temperature) - reading.reference_temperature
    per_read = reading.radial_per_read
    radial = (np.asarray(records.deformation) - base.deformation_offset) * per_read
    soft = 1.0 - base.alpha * rise
    slope = [
        log_sd * radial * soft,
        -moments(priors, "alpha")[1] * rise * radial,
        -moments(priors, "deformation_offset")[1] * per_read * soft,
    ]
    offset = np.full(len(rise), moments(priors, "force_offset")[1])
    stiffness, modulus, zero = float(base.stiffness) * np.stack(slope)
    return np.stack([stiffness, offset, modulus, zero], axis=1)


def run_columns(records: Records) -> Float[np.ndarray, "n r"]:
    """Return what tells the force offsets of runs from their mean [N].

    Their prior sd is the largest force: so wide that it favours no hypothesis.
    """
    runs, run = np.unique(records.run, return_inverse=True)
    contrasts = np.eye(len(runs))[:, 1:] - 1.0 / len(runs)
    return float(np.max(np.abs(records.force))) * contrasts[run]
