"""How far the gap shrinks: the ladder, and what closes on blocks left out."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdcal.diagnosis.verdict import Rung, Shrink
from hdcal.diagnosis.where import interval
from hdcal.evidence.additive_gap import (
    DETECTED,
    REMAINDER,
    Additive,
    Basis,
    fit_additive,
)
from hdcal.evidence.assessment import Assessment, design_of
from hdcal.evidence.design_matrix import Design, fit_design, join_designs
from hdcal.evidence.held_out import design_without
from hdcal.evidence.kernels import blocks_of
from hdcal.evidence.prepare import spread_out, within_run
from hdcal.report.parameters import Interval

_SAMPLES = 1000
# Sds of its own error by which a remainder must lower the noise variance to count.
_VISIBLE = 1.64
# A free curve of as many parameters may be this large, in noise sds.
_FREE = 30.0


def shrink(
    found: Assessment,
    names: Sequence[str],
    members: Sequence[str],
    basis: Basis,
    correlation: float,
    rng: np.random.Generator,
) -> Shrink:
    """Return the ladder and the closed share for the named effects.

    Args:
        found: evidences.
        names: effects that are added together; empty when none was named.
        members: of the set, each compared alone.
        basis: of the smooth remainder.
        correlation: AR(1) coefficient of the noise.
        rng: source of randomness.
    """
    setting, rows = found.setting, found.setting.rows
    reading = np.asarray(rows.reading)
    design = design_of(found, names)
    base = fit_design(
        rows, join_designs([], len(reading)), setting.noise_sd, correlation
    )
    full = fit_design(rows, design, setting.noise_sd, correlation)
    rest = reading - full.contribution(rows.base.shape[1])
    floor = REMAINDER if names else DETECTED
    after = fit_additive(setting, basis, correlation, rng, rest, floor)
    left = [reading - base.predict(), reading - full.predict()]
    after = _without_needless(after, left[1] * rows.weight, 3 + len(design.columns))
    remainder = left[1] - after.mean
    noise = after.noise_sd
    ladder = [
        Rung("nominal", _rms(_nominal_residual(found))),
        Rung("calibrated", _rms(left[0])),
    ]
    if names:
        ladder.append(Rung("calibrated+" + "+".join(names), _rms(left[1])))
    last = "calibrated+" + "+".join([*names, "remainder"])
    ladder += [Rung(last, _rms(remainder)), Rung("noise", noise)]
    if not names:
        reason = "no effect of the library is named, so that none can be added"
    elif not len(design.columns):
        reason = f"{' and '.join(names)} changes the noise, not the mean force"
    else:
        reason = ""
    if reason:
        return Shrink(tuple(ladder), None, "", None, None, interval(after.rms), reason)
    closed, held_out = closed_share(found, names, after, correlation, rng)
    return Shrink(
        ladder=tuple(ladder),
        closed=closed,
        held_out=held_out,
        extrapolated_closed=_extrapolated(found, names, noise, correlation),
        placebo_closed=_placebo(found, len(design.columns), noise, correlation),
        remainder_N=interval(after.rms),
        reason="" if closed else "no block shows a gap beyond the noise",
        bars=_bars(found, members, after, correlation, rng),
    )


def _without_needless(after: Additive, left: np.ndarray, used: int) -> Additive:
    """Return the noise beside the effects alone where no remainder is to be seen.

    A smooth remainder always takes a little noise along, and the closed share is the
    root of a small difference: it would come out too low.
    """
    size = len(left)
    alone = np.sum(left**2) / max(size - used, 1)
    if alone - after.noise_sd**2 > _VISIBLE * np.sqrt(2.0 / size) * alone:
        return after
    ratio = alone / after.noise_sd**2
    return replace(
        after, noise_sd=float(np.sqrt(alone)), variance=after.variance * ratio
    )


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _nominal_residual(found: Assessment) -> np.ndarray:
    """Return readings minus the formula itself: K = 1, no offset."""
    setting = found.setting
    records, reading = setting.records, setting.reading
    rise = np.asarray(records.temperature) - reading.reference_temperature
    radial = np.asarray(records.deformation) * reading.radial_per_read
    modulus = 1.0 - setting.base.alpha * rise
    return np.asarray(records.force) - setting.nominal * modulus * radial


def _bars(found, members, after, correlation, rng) -> dict[str, float]:
    bars = {}
    for name in members:
        closed, _ = closed_share(found, [name], after, correlation, rng)
        if closed is not None:
            bars[name] = closed.median
    return bars


def closed_share(
    found: Assessment,
    names: Sequence[str],
    after: Additive,
    correlation: float,
    rng: np.random.Generator,
) -> tuple[Interval | None, str]:
    """Return the share of the gap that effects close on blocks they never saw.

    Base and effects are fitted without the block, shapes included. Noise and the
    variance of the prediction are taken off both mean squares.

    Args:
        found: evidences.
        names: effects that are added together.
        after: noise beside the effects and a smooth remainder.
        correlation: AR(1) coefficient of the noise.
        rng: source of randomness.

    Returns:
        Median and 90 % interval over resampled blocks and draws of the noise
        variance, and what was left out.
    """
    block, word = _left_out(found, names)
    parts = np.array(
        [
            _squares(found, names, block != index, after.noise_sd, correlation)
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
    low, high = np.quantile(closed, [0.05, 0.95])
    middle = float(_closed(weight @ parts / weight.sum(), after.noise_sd**2)[0])
    middle = float(np.median(closed)) if np.isnan(middle) else middle
    # With few blocks the prediction's own variance is only an estimate: the lower end
    # does without it.
    careful = _closed(squares + squares[:, 3:] * [0.0, 1.0, 0.0, 0.0], variance)
    low = min(low, float(np.nanquantile(careful, 0.05)))
    low, high = min(float(low), middle), max(float(high), middle)
    return Interval(middle, low, high), f"leave-one-{word}-out"


def _left_out(found: Assessment, names: Sequence[str]) -> tuple[np.ndarray, str]:
    """Return the block of each row, and what a block is called."""
    records = found.setting.records
    if set(names) & set(found.scatter):
        # What a whole member is like cannot be told without any row of it.
        quarter = np.clip((within_run(records.run) + 1.0) * 2.0, 0, 3).astype(int)
        return quarter, "quarter"
    word = "half-cycle" if "unloading" in records.known else "stretch"
    return blocks_of(records), word


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


def _squares(found, names, kept, noise: float, correlation: float) -> np.ndarray:
    """Return what `_compare` does for base and effects, shapes chosen anew."""
    rows = found.setting.rows
    designs = join_designs([], len(rows.reading)), design_without(found, names, kept)
    return _compare(rows, designs, kept, noise, correlation)


def _compare(rows, designs, kept, noise: float, correlation: float) -> np.ndarray:
    """Compare two designs on the rows that were left out.

    Returns:
        Mean squared errors less the variance of the prediction, of both [N²]; the
        share of the noise variance in them; the variance of the second prediction.
    """
    (before, _), (after, spread) = (
        _square(rows, each, kept, noise, correlation) for each in designs
    )
    level = np.mean(1.0 / np.asarray(rows.weight)[~kept] ** 2)
    return np.array([before, after, level, spread])


def _square(rows, design: Design, kept, noise: float, correlation: float):
    fit = fit_design(rows, design, noise, correlation, kept)
    error = (np.asarray(rows.reading) - fit.predict())[~kept]
    columns = fit.columns[~kept]
    spread = np.mean(np.einsum("ni,ij,nj->n", columns, fit.covariance, columns))
    return float(np.mean(error**2) - spread), float(spread)


def _extrapolated(found, names, noise, correlation) -> float | None:
    """Return the closed share on the upper third of the deformation."""
    kept = spread_out(found.setting.records.deformation) < 1.0 / 3.0
    if not 3 <= np.count_nonzero(~kept) <= len(kept) - 3:
        return None
    squares = _squares(found, names, kept, noise, correlation)
    closed = _closed(squares, noise**2)[0]
    return float(closed) if np.isfinite(closed) else None


def _placebo(found, count: int, noise: float, correlation: float) -> float | None:
    """Return the closed share of a free curve in deformation of as many parameters."""
    rows = found.setting.rows
    scaled = spread_out(found.setting.records.deformation)
    order = np.arange(2, 2 + max(count, 1))[:, None]
    columns = np.cos(np.pi * order * (scaled + 1.0) / 2.0)
    size = len(columns)
    curve = Design(
        np.zeros(len(scaled)), columns, np.zeros(size), np.full(size, _FREE * noise), {}
    )
    block = blocks_of(found.setting.records)
    empty = join_designs([], len(scaled))
    parts = np.array(
        [
            _compare(rows, (empty, curve), block != i, noise, correlation)
            for i in range(int(block.max()) + 1)
        ]
    )
    weight = np.bincount(block)
    closed = _closed(weight @ parts / weight.sum(), noise**2)[0]
    return float(closed) if np.isfinite(closed) else None
