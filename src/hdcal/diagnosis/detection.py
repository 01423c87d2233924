"""Is there a gap? The residual test, and what follows from it before any name."""

from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Case
from hdcal.diagnosis.gap import Gap, Where
from hdcal.diagnosis.model_posterior import ModelPosterior
from hdcal.diagnosis.where import (
    FALSE_ALARM,
    declared_directions,
    describe_where,
)
from hdcal.evidence.case_evidence import NONE, QUANTISATION, CaseEvidence
from hdcal.evidence.residual_test import residual_test
from hdcal.evidence.smooth_gap import (
    AdditiveBasis,
    SmoothGap,
    additive_basis,
    fit_smooth_gap,
)
from hdcal.report.intervals import Interval, credible_interval

# An AR(1) coefficient of this probability stands alone among those weighed.
_DECIDED = 0.9
_NOT_SEEN = Interval(np.nan, np.nan, np.nan)


@dataclass(frozen=True)
class Detection:
    """Outcome of the search for a gap.

    Attributes:
        posterior: over hypotheses.
        correlation: posterior mean of the noise's AR(1) coefficient.
        where: the residual test and the smooth gap in values for people.
        noise_sd: of a reading beside the base model [N].
        basis: of the smooth gap; None where no gap is detected.
        smooth: the smooth gap; None where none is detected.
        rounding_step: of rounded readings, where nothing else is detected [N].
    """

    posterior: ModelPosterior
    correlation: float
    where: Where
    noise_sd: float
    basis: AdditiveBasis | None = None
    smooth: SmoothGap | None = None
    rounding_step: float | None = None

    @property
    def detected(self) -> bool:
        """Whether there is a gap."""
        return self.smooth is not None

    def gap(self, case: Case, noise_sd: float | None) -> Gap:
        """Return whether there is a gap and how large it is.

        Args:
            case: for the largest force.
            noise_sd: of a reading [N]; None for that of the base model.
        """
        size = _NOT_SEEN if self.smooth is None else credible_interval(self.smooth.rms)
        return Gap(
            self.detected,
            1.0 - self.posterior.probabilities[NONE],
            size,
            self.noise_sd if noise_sd is None else noise_sd,
            size.median / float(np.max(np.abs(case.records.force))),
            self.correlation,
            self.rounding_step,
        )


def correlation_between(
    correlations: np.ndarray, weight: np.ndarray, log_evidence: np.ndarray
) -> float:
    """Return the likeliest AR(1) coefficient, between those that were weighed.

    Many rows leave one of them only, and none may be the true one: Fisher's z of it is
    where a parabola through the three about the likeliest has its peak. At an end, and
    where few rows leave several, it is the mean.

    Args:
        correlations: that were weighed, increasing, shape (r,).
        weight: posterior of each, shape (r,).
        log_evidence: of the likeliest hypothesis at each; −inf where not weighed.
    """
    at, mean = int(np.argmax(weight)), float(weight @ correlations)
    about = slice(at - 1, at + 2)
    if weight[at] < _DECIDED or not 0 < at < len(correlations) - 1:
        return mean
    if not np.isfinite(log_evidence[about]).all():
        return mean
    z = np.arctanh(correlations[about])
    curve, slope, _ = np.polyfit(z - z[1], log_evidence[about], 2)
    if curve >= 0.0:
        return mean
    return float(np.tanh(np.clip(z[1] - 0.5 * slope / curve, z[0], z[2])))


def detect_gap(
    evidence: CaseEvidence,
    posterior: ModelPosterior,
    case: Case,
    rng: np.random.Generator,
) -> Detection:
    """Test the base model; where it fails, fit a smooth gap."""
    prepared = evidence.prepared
    heights = evidence.table[posterior.top]
    correlation = correlation_between(
        prepared.rows.correlations, posterior.correlation, heights
    )
    cells, directions = declared_directions(evidence, case)
    tested = residual_test(prepared, correlation, directions, rng)
    significant = tested.p_value <= FALSE_ALARM
    rounded = QUANTISATION in posterior.top.split("+")
    if not (significant or rounded):
        where = describe_where(evidence, case, cells, tested, None)
        return Detection(posterior, correlation, where, tested.noise_sd)
    basis = additive_basis(prepared)
    smooth = fit_smooth_gap(prepared, basis, correlation, rng)
    where = describe_where(evidence, case, cells, tested, smooth)
    step = None if significant else evidence.rounding_step
    return Detection(
        posterior, correlation, where, tested.noise_sd, basis, smooth, step
    )
