"""Faults in the records of gears, found by comparison with the other gears.

Screening finds jumps, drops and saturation in a record. Comparison finds a record that
is not smooth, one in another unit, and two parts under one label. A gear with a
fault is left out whole, since a fault is no scatter between gears.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import norm, t

from hdcal.data.measurements.bad_gears import among
from hdcal.errors import Finding
from hdcal.fleets.model.groups import robust_sd
from hdcal.fleets.model.line_fits import fit_terms
from hdcal.fleets.reading.readings import FleetReadings, MountingSums, RowSums
from hdcal.screening.result import MACHINE_CLASS
from hdcal.screening.wild import FEWEST

# Share of squares that rounding leaves of a deformation that stays, and of residuals.
_ROUNDING = 1e-20
# No gear of a kind is so many times as stiff as the others, or as soft; other units of
# force or length are 9.8 (kgf), 25.4 (inch) or 1000 times as large. Gears of several
# sizes may be: so many robust sds it has to be as well.
_OTHER_UNIT, _FAR = 8.0, 6.0
# A share of the largest stiffness that is none.
_FLAT = 1e-9
# The residuals of a record without a curve: in those of the usual gear, as a share of
# the range of its force, and the correlation of neighbours in its standard error.
_TIMES, _SHARE, _ALIKE = 5.0, 0.01, 3.0
# Probability that one of all gears without a fault is taken for two parts, degrees of
# freedom of the tails of their scatter, and a difference that the rig may make.
_TWO_PARTS, _TAILS, _SAME = 1e-3, 8.0, 2.0 * MACHINE_CLASS
# Correlation of neighbours that is taken into account at most; sweeps of the polish.
_MOST_ALIKE, _SWEEPS = 0.99, 5
# Probability of each of two tests that a regular record fails it.
_IRREGULAR = 2e-3

_REMEDY = "Correct the record, or leave the gear out"

# Index of a gear, and what is wrong with it.
_Fault = tuple[Any, str]


class CurveFits(NamedTuple):
    """Line, loop, bend and zero of p sets of rows by least squares.

    The residual as a combination of v, (p, 4), the degrees of freedom that are left,
    the sd of the residuals [N] and the correlation of neighbouring ones.
    """

    residual: np.ndarray
    free: np.ndarray
    sd: np.ndarray
    alike: np.ndarray


def curve_fits(sums: MountingSums | RowSums) -> CurveFits:
    """Fit line, loop and bend to each set of rows."""
    fits = fit_terms(sums.products, (0, 1, 2), sums.rows - 1.0)
    free = sums.rows - 1.0 - fits.known.sum(axis=1)
    square = fits.squares(sums.products)
    exact = square <= _ROUNDING * sums.products[:, 3, 3]
    square = np.where(exact, 1.0, square)
    sd = np.where(exact, 0.0, np.sqrt(square / np.maximum(free, 1.0)))
    alike = np.where(exact, 0.0, fits.squares(sums.lagged) / square)
    return CurveFits(fits.residual, free, sd, alike)


def irregular(
    sums: RowSums, v: np.ndarray, index: np.ndarray, *, relative: bool = False
) -> np.ndarray:
    """Return sets of rows whose residuals are not independent and normal, shape (p,).

    Tests of their largest one and of the correlation of neighbours, relative to that of
    the usual set or not. Of fewer than `FEWEST` rows screening checks the sign only.
    Rows have v, (4, n), and the index of their set, (n,).
    """
    fits = curve_fits(sums)
    usual = np.median(fits.alike) if relative else 0.0
    error = np.abs(np.sum(fits.residual[index].T * (v - sums.mean[index].T), axis=0))
    largest = np.zeros(len(sums.rows))
    np.maximum.at(largest, index, error)
    # Bonferroni's bound of studentised residuals.
    free = np.maximum(fits.free, 2.0)
    far = t.isf(_IRREGULAR / (2.0 * sums.rows), free - 1.0)
    far *= np.sqrt(free / (free - 1.0 + far**2))
    alike = np.abs(fits.alike - usual) * np.sqrt(sums.rows)
    alike = alike > norm.isf(_IRREGULAR / 2.0)
    odd = (alike | (largest > far * fits.sd)) & (sums.rows >= FEWEST)
    return odd | (sums.products[:, 0, 3] <= 0.0)


def faults_among_gears(
    readings: FleetReadings, *, smooth: bool = True
) -> dict[str, Finding]:
    """Return gears whose record at one size differs from the others, with its fault.

    A record that is not smooth is a fault only where that is asked for.
    """
    case, sums = readings.case, readings.sums
    bad: dict[str, Finding] = {}
    # Each test is of the gears that passed the one before.
    tests = [_no_slope, *([_not_smooth] if smooth else []), _two_parts]
    for test in tests:
        if len(sums.gear):
            for gear, problem in test(readings, sums):
                label = case.specimen_labels[gear]
                bad.setdefault(label, Finding(case.name, problem, _REMEDY))
            sums = sums.where(~among(case.specimen_labels, bad)[sums.gear])
    return bad


def _no_slope(readings: FleetReadings, sums: MountingSums) -> Iterator[_Fault]:
    """Yield gears that never moved in a run, or have a stiffness that no gear has."""
    units, rows = readings.case.units, np.bincount(sums.gear)
    place = np.bincount(sums.gear, sums.rows * sums.mean[:, 0] ** 2)
    square, pull = (np.bincount(sums.gear, sums.products[:, 0, k]) for k in (0, 3))
    still = (square <= _ROUNDING * place) & (rows > 0)
    words = (
        f"it was read at one {units.displacement} only in each of its runs: read it "
    )
    for gear in np.flatnonzero(still):
        yield gear, f"{words}at two or more in one run"
    gears = np.flatnonzero(~still & (rows > 0))
    slope = pull[gears] / square[gears]
    flat = slope <= _FLAT * np.max(np.abs(slope), initial=0.0)
    for gear in gears[flat]:
        yield gear, f"the {units.load} does not grow with the {units.displacement}"
    gears, slope = gears[~flat], slope[~flat]
    if not len(gears):
        return
    apart = np.log(slope / np.median(slope))
    far = np.abs(apart) > max(np.log(_OTHER_UNIT), _FAR * robust_sd(apart))
    for gear, times in zip(gears[far], np.exp(apart[far]), strict=True):
        words = f"{times:.0f} times" if times >= 1.0 else f"1/{1.0 / times:.0f} of"
        words = f"its stiffness is {words} that of the other gears"
        yield gear, f"{words}: check its units, and whether it is of this kind"


def _not_smooth(readings: FleetReadings, sums: MountingSums) -> Iterator[_Fault]:
    """Yield gears with residuals far larger than those of others that are not noise."""
    fits, unit = curve_fits(sums), readings.case.units.load_unit
    usual = float(np.median(fits.sd))
    # Readings that are spread evenly have the variance of their range over twelve.
    spread = np.sqrt(12.0 * sums.products[:, 3, 3] / sums.rows)
    far = (fits.sd > _TIMES * usual) & (fits.sd > _SHARE * spread)
    far &= fits.alike * np.sqrt(sums.rows) > _ALIKE
    for gear, sd in zip(sums.gear[far], fits.sd[far], strict=True):
        yield (
            gear,
            "its readings do not follow a smooth curve: residual sd "
            f"{sd:.2g} {unit}, other gears {usual:.2g} {unit}. Possible causes: a "
            "break, a stuck channel, or two parts under one label",
        )


def _two_parts(readings: FleetReadings, sums: MountingSums) -> Iterator[_Fault]:
    """Yield gears whose mountings differ far more than those of other gears.

    The scatter of mountings is a robust estimate from n differences, in addition to
    their errors. The median of n has the tails of (n + 1)/2 degrees of freedom.
    """
    case = readings.case
    table: Any = _log_stiffness(sums.where(sums.products[:, 0, 0] > 0.0))
    table["count"] = table.groupby("gear")["place"].transform("size")
    table = table[table["count"] > 1]
    if table.empty:
        return
    if case.rigs:
        rig = np.array(case.rigs)[table["run"]]
        table = table.assign(place=table["place"] - _gains(table, rig))
    ends = table.sort_values("place").groupby("gear")
    low, high, many = ends.first(), ends.last(), ends.size().to_numpy()
    # Bessel's correction of the deviations from the mean of a gear.
    off = table["place"] - table.groupby("gear")["place"].transform("mean")
    off *= np.sqrt(table["count"] / (table["count"] - 1.0))
    own = robust_sd(off.to_numpy()) ** 2 - float(table["variance"].median())
    variance = low["variance"] + high["variance"] + 2.0 * max(own, 0.0)
    gap, scatter = (high["place"] - low["place"]).to_numpy(), np.sqrt(variance)
    chances, free = float(np.sum(many * (many - 1.0))), float(np.sum(many - 1.0))
    limit = t.isf(_TWO_PARTS / chances, min((free + 1.0) / 2.0, _TAILS)) * scatter
    usual = 100.0 * float(np.median(scatter))
    for index in np.flatnonzero(gap > np.maximum(limit, _SAME)):
        softer, stiffer = (
            case.run_labels[end["run"].iloc[index]] for end in (low, high)
        )
        yield (
            low.index[index],
            f"mounting {stiffer} is {100.0 * np.expm1(gap[index]):.2g} % stiffer than "
            f"{softer}, and mountings of other gears differ by {usual:.2g} % (sd): two "
            "parts under one label",
        )


def _log_stiffness(sums: MountingSums) -> pd.DataFrame:
    """Return log stiffness and its variance of mountings, less usual loop and bend."""
    fits, square = curve_fits(sums), sums.products[:, 0, 0]
    loop, bend = np.median(fits.residual[:, 1:3], axis=0)
    pull = sums.products[:, 0] @ np.array([0.0, loop, bend, 1.0])
    pull = np.maximum(pull, np.finfo(float).tiny)
    alike = np.clip(np.median(fits.alike), 0.0, _MOST_ALIKE)
    noise = np.maximum(fits.sd, np.median(fits.sd)) ** 2 * (1 + alike) / (1 - alike)
    columns = {"place": np.log(pull / square), "variance": noise * square / pull**2}
    return pd.DataFrame({"gear": sums.gear, "run": sums.run} | columns)


def _gains(table: pd.DataFrame, rig: np.ndarray) -> np.ndarray:
    """Return the log gain of the rig of each mounting, by median polish."""
    gain = np.zeros(len(table))
    for _ in range(_SWEEPS):
        off = table["place"] - gain
        off -= off.groupby(table["gear"]).transform("median")
        gain += off.groupby(rig).transform("median").to_numpy()
    return gain
