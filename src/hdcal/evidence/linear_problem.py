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
from hdcal.data.prior import Prior
from hdcal.data.priors import effect_priors
from hdcal.data.records import Records
from hdcal.data.scatter import left_of_lines
from hdcal.evidence import base_model
from hdcal.evidence.row_features import take_rows, tolerance_functions
from hdcal.inference import distributions
from hdcal.inference.force_model import serial_correlation
from hdcal.inference.force_model.noise_form import pilot_fit
from hdcal.inference.force_model.padding import pad_records
from hdcal.inference.force_model.priors import problem_priors
from hdcal.inference.force_model.problem import case_reading
from hdcal.physics.chain import Base, Reading
from hdcal.physics.effect import Effect

# Least noise sd as a share of the largest force: computed readings have no noise.
_LEAST_NOISE = 1e-6


@dataclass(frozen=True)
class LinearProblem:
    """Rows of one case, run after run, with the columns of its base model.

    Attributes:
        base: parameters about which effects are evaluated.
        y: force less the prior mean of the base model [N].
        X: columns of the base model [N per prior sd].
        noise_sd: reference noise sd [N]; the prior sds of b are multiplied by the noise
            sd over this one, which keeps the noise sd a scale of the whole problem.
        before: index of the row before in the same run, −1 for a run's first.
        weight: one over the relative noise sd that the file states for each row.
        tolerance: smooth functions by which an effect's shape may deviate.
        log_shift: prior mean of the log stiffness less that of `base`; `log_sd` its sd.
        offsets: number of columns of X that are offsets of runs; their priors are so
            wide that each uses up a row.
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

        As `serial_correlation.whiten`, with rows along the last axis, which is faster
        here. The weight of a row is one over its relative noise sd.
        """
        scaled = curves * weight
        if correlation == 0.0:
            return scaled
        follows, gain = self.before >= 0, (1.0 - correlation**2) ** -0.5
        scale = np.where(follows, gain, 1.0)
        tied = np.where(follows, correlation * gain, 0.0)
        return scale * scaled - tied * scaled[..., self.before]

    @property
    def count(self) -> int:
        """Number of rows that are neither left out nor used up by offsets of runs."""
        return int(np.count_nonzero(self.weight)) - self.offsets

    def without(self, left_out: Bool[np.ndarray, " n"]) -> "LinearProblem":
        """Return the problem in which some rows have no weight."""
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


def padded_records(records: Records) -> Records:
    """Return records of a length that many cases share, for one executable.

    `known` is left out: only the `needs` of effects depend on it.
    """
    return pad_records(replace(records, known=frozenset()))


def linear_problem(
    case: Case,
    library: Mapping[str, type[Effect]],
    *,
    noise_sd: float | None = None,
    stiffness: float | None = None,
    free_runs: bool = False,
) -> LinearProblem:
    """Return the linear problem of a case, with the priors of effects by name.

    Reference noise sd [N] and the stiffness about which effects are evaluated [N/mm]
    are estimated unless given. With `free_runs` each run has an unknown force offset.

    Raises:
        InputError: an effect has no prior.
    """
    order = np.argsort(np.asarray(case.records.run), kind="stable")
    records, reading = take_rows(case.records, order), case_reading(case)
    shipped, effects = effect_priors(case.gear.full_scale), [*library.values()]
    priors = problem_priors(case, effects, shipped, case.gear.theory)
    least = _LEAST_NOISE * float(np.max(np.abs(records.force)))
    least = max(least, case.gear.force_resolution / np.sqrt(12.0))
    noise_sd = float(max(noise_sd or _noise_sd(records, least), least))
    log_mean, log_sd, _ = base_model.stiffness_prior(case, priors)
    base = base_model.base_at(
        records, reading, priors, noise_sd, stiffness, np.exp(log_mean)
    )
    columns = base_model.base_columns(records, reading, priors, base, log_sd)
    log_shift = log_mean - float(np.log(float(base.stiffness)))
    mean = base.force_offset + columns[:, 0] / log_sd * (1.0 + log_shift)
    offsets = base_model.run_columns(records) if free_runs else np.zeros((len(mean), 0))
    return LinearProblem(
        records=records,
        reading=reading,
        base=base,
        priors=priors,
        y=np.asarray(records.force) - mean,
        X=np.hstack([columns, offsets]),
        noise_sd=noise_sd,
        before=serial_correlation.previous_rows(records),
        weight=1.0 / np.sqrt(1.0 + (np.asarray(records.force_sd) / noise_sd) ** 2),
        tolerance=tolerance_functions(records),
        log_shift=log_shift,
        log_sd=log_sd,
        offsets=offsets.shape[1],
    )


def _noise_sd(records: Records, least: float) -> float:
    """Return a first noise sd [N]; where the pilot fit is exact, that of lines."""
    found = pilot_fit(records).noise_sd
    if found > least:
        return found
    left = left_of_lines(records, np.asarray(records.force))
    lines = len(np.unique(records.run)) + len(np.unique(records.specimen))
    return float(np.sqrt(left @ left / max(len(left) - lines, 1)))
