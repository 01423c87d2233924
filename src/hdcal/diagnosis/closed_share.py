"""The share of the gap that closes on readings that were not fitted to."""

from collections.abc import Sequence

import numpy as np

from hdcal.evidence.case_evidence import CaseEvidence
from hdcal.evidence.design_matrix import DesignMatrix, fit_design, join_designs
from hdcal.evidence.hypothesis_design import held_out_design
from hdcal.evidence.linear_rows import LinearRows
from hdcal.evidence.row_features import (
    half_cycle_blocks,
    place_in_run,
    scale_to_unit,
)
from hdcal.evidence.smooth_gap import SmoothGap
from hdcal.report.intervals import INTERVAL, Interval

_SAMPLES = 1000
# A free curve of as many parameters may be this large, in noise sds.
_FREE = 30.0


def closed_share(
    evidence: CaseEvidence,
    names: Sequence[str],
    after: SmoothGap,
    correlation: float,
    rng: np.random.Generator,
) -> tuple[Interval | None, str]:
    """Return the share of the gap that effects close on blocks they never saw.

    Base and effects are fitted without the block, shapes included. Noise and the
    variance of the prediction are taken off both mean squares.

    Args:
        evidence: of the hypotheses.
        names: effects that are added together.
        after: noise beside the effects and a smooth remainder.
        correlation: AR(1) coefficient of the noise.
        rng: source of randomness.

    Returns:
        Median and 95 % interval over resampled blocks and draws of the noise
        variance, and what was left out.
    """
    block, word = _left_out(evidence, names)
    parts = np.array(
        [
            _squares(evidence, names, block != index, after.noise_sd, correlation)
            for index in range(int(block.max()) + 1)
        ]
    )
    weight = np.bincount(block).astype(float)
    picked = rng.multinomial(len(parts), np.full(len(parts), 1 / len(parts)), _SAMPLES)
    squares = picked * weight @ parts / (picked @ weight)[:, None]
    variance = rng.choice(after.variance, _SAMPLES)
    closed = _closed(squares, variance)
    closed = closed[np.isfinite(closed)]
    if len(closed) < _SAMPLES // 2:
        return None, f"leave-one-{word}-out"
    below = 0.5 - 0.5 * INTERVAL
    low, high = np.quantile(closed, [below, 1.0 - below])
    middle = float(_closed(weight @ parts / weight.sum(), after.noise_sd**2)[0])
    middle = float(np.median(closed)) if np.isnan(middle) else middle
    # With few blocks the prediction's own variance is only an estimate: the lower end
    # does without it.
    careful = _closed(squares + squares[:, 3:] * [0.0, 1.0, 0.0, 0.0], variance)
    low = min(low, float(np.nanquantile(careful, below)))
    low, high = min(float(low), middle), max(float(high), middle)
    return Interval(middle, low, high), f"leave-one-{word}-out"


def _left_out(evidence: CaseEvidence, names: Sequence[str]) -> tuple[np.ndarray, str]:
    """Return the block of each row, and what a block is called."""
    records = evidence.prepared.records
    if set(names) & set(evidence.scatter):
        # What a whole member is like cannot be told without any row of it.
        quarter = np.clip((place_in_run(records.run) + 1.0) * 2.0, 0, 3).astype(int)
        return quarter, "quarter"
    word = "half-cycle" if "unloading" in records.known else "stretch"
    return half_cycle_blocks(records), word


def _closed(squares: np.ndarray, variance) -> np.ndarray:
    """Return 1 − G₁/G₀, NaN where there is no gap to close.

    Args:
        squares: mean squares before and after, and the noise's share, in the first
            three columns.
        variance: of the noise [N²].
    """
    before, after, level = np.atleast_2d(squares).T[:3]
    gap, left = before - variance * level, after - variance * level
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.sqrt(np.maximum(left, 0.0) / np.where(gap > 0.0, gap, np.nan))
    return 1.0 - ratio


def _finite(closed: np.ndarray) -> float | None:
    return float(closed[0]) if np.isfinite(closed[0]) else None


def _squares(evidence, names, kept, noise: float, correlation: float) -> np.ndarray:
    """Return what `_compare` does for base and effects, shapes chosen anew."""
    design = held_out_design(evidence, names, kept)
    return _compare(evidence.prepared.rows, design, kept, noise, correlation)


def _compare(
    rows: LinearRows, design: DesignMatrix, kept, noise: float, correlation: float
) -> np.ndarray:
    """Compare the base model alone and with a design on the rows that were left out.

    Returns:
        Mean squared errors less the variance of the prediction, of both [N²]; the
        share of the noise variance in them; the variance of the second prediction.
    """
    empty = join_designs([], len(rows.reading))
    before, _ = _square(rows, empty, kept, noise, correlation)
    after, spread = _square(rows, design, kept, noise, correlation)
    level = np.mean(1.0 / rows.weight[~kept] ** 2)
    return np.array([before, after, level, spread])


def _square(
    rows: LinearRows, design: DesignMatrix, kept, noise: float, correlation: float
) -> tuple[float, float]:
    """Return mean squared error and mean variance of the prediction, left-out rows."""
    fit = fit_design(rows, design, noise, correlation, kept)
    error = (rows.reading - fit.predict())[~kept]
    columns = fit.columns[~kept]
    spread = np.mean(np.einsum("ni,ij,nj->n", columns, fit.covariance, columns))
    return float(np.mean(error**2) - spread), float(spread)


def extrapolated_share(
    evidence: CaseEvidence, names: Sequence[str], noise: float, correlation: float
) -> float | None:
    """Return the closed share on the upper third of the deformation, left out.

    Args:
        evidence: of the hypotheses.
        names: effects that are added together.
        noise: sd of a reading [N].
        correlation: AR(1) coefficient of the noise.

    Returns:
        None where there is no gap, or too few rows on either side.
    """
    kept = scale_to_unit(evidence.prepared.records.deformation) < 1.0 / 3.0
    if not 3 <= np.count_nonzero(~kept) <= len(kept) - 3:
        return None
    return _finite(
        _closed(_squares(evidence, names, kept, noise, correlation), noise**2)
    )


def placebo_share(
    evidence: CaseEvidence, count: int, noise: float, correlation: float
) -> float | None:
    """Return the closed share of a free curve in deformation of as many parameters.

    Args:
        evidence: of the hypotheses.
        count: parameters of the curve.
        noise: sd of a reading [N].
        correlation: AR(1) coefficient of the noise.
    """
    records = evidence.prepared.records
    scaled = scale_to_unit(records.deformation)
    order = np.arange(2, 2 + max(count, 1))[:, None]
    columns = np.cos(np.pi * order * (scaled + 1.0) / 2.0)
    size = len(columns)
    free = np.full(size, _FREE * noise)
    curve = DesignMatrix(np.zeros(len(scaled)), columns, np.zeros(size), free, {})
    block = half_cycle_blocks(records)
    parts = np.array(
        [
            _compare(evidence.prepared.rows, curve, block != i, noise, correlation)
            for i in range(int(block.max()) + 1)
        ]
    )
    weight = np.bincount(block)
    return _finite(_closed(weight @ parts / weight.sum(), noise**2))
