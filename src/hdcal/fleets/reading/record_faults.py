"""Faults in the records of gears, found by comparison with the other gears.

Screening finds jumps, drops and saturation in a record. Comparison finds a record that
follows no curve, one in another unit, and two mountings of different parts. A gear with
a fault is left out whole, since a fault is no scatter between gears.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import norm, t

from hdcal.errors import Finding
from hdcal.fleets.model.groups import robust_sd
from hdcal.fleets.model.line_fits import MOST_CORRELATION, fit_terms, widening
from hdcal.fleets.reading.mounting_sums import MountingSums, RowSums
from hdcal.fleets.reading.readings import FleetReadings
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
# Probability of each of two tests that a regular record fails it.
_IRREGULAR = 2e-3

# Index of a gear, and what is wrong with it.
_Fault = tuple[Any, str]


class CurveFits(NamedTuple):
    """Line, loop and bend of sets of rows by least squares, each with its own zero.

    Attributes:
        residual: the residual as a combination of v, shape (p, 4).
        free: degrees of freedom that are left, shape (p,).
        sd: of the residuals, shape (p,) [N].
        alike: correlation of neighbouring residuals, shape (p,).
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

    Tests of their largest one and of the correlation of neighbours; screening looks at
    records of fewer than `FEWEST` rows for their sign only.

    Args:
        sums: of each set.
        v: of every row, shape (4, n).
        index: of the set of each row, shape (n,).
        relative: whether the correlation is compared with that of the usual set.
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


def faults_among_gears(readings: FleetReadings) -> dict[str, Finding]:
    """Return gears whose record differs from those of all others, each with its fault.

    The readings are those at one size.
    """
    case, sums = readings.case, readings.sums
    bad: dict[int, Finding] = {}
    # Each test is of the gears that passed those before it.
    for test, remedy in _TESTS.items():
        if not len(sums.gear):
            break
        for gear, problem in test(readings, sums):
            bad.setdefault(int(gear), Finding(case.name, problem, remedy))
        sums = sums.where(~np.isin(sums.gear, [*bad]))
    return {case.specimen_labels[gear]: why for gear, why in bad.items()}


def _still(readings: FleetReadings, sums: MountingSums) -> Iterator[_Fault]:
    """Yield gears that never moved in a run, which has its zero."""
    moved = np.bincount(sums.gear, sums.products[:, 0, 0])
    place = np.bincount(sums.gear, sums.rows * sums.mean[:, 0] ** 2)
    still = moved <= _ROUNDING * place
    for gear in np.flatnonzero(still & (np.bincount(sums.gear) > 0)):
        name = readings.case.units.displacement
        yield gear, f"it was read at one {name} only in each of its runs"


def _other_unit(readings: FleetReadings, sums: MountingSums) -> Iterator[_Fault]:
    """Yield gears of a stiffness that no gear of the kind has."""
    units, gears = readings.case.units, np.unique(sums.gear)
    square, pull = (
        np.bincount(sums.gear, sums.products[:, 0, k])[gears] for k in (0, 3)
    )
    slope = pull / square
    flat = slope <= _FLAT * np.max(np.abs(slope))
    for gear in gears[flat]:
        yield gear, f"the {units.load} does not grow with the {units.displacement}"
    if flat.all():
        return
    gears, times = gears[~flat], slope[~flat] / np.median(slope[~flat])
    apart = np.abs(np.log(times))
    far = apart > max(np.log(_OTHER_UNIT), _FAR * robust_sd(apart))
    for gear, ratio in zip(gears[far], times[far], strict=True):
        words = f"{ratio:.0f} times" if ratio >= 1.0 else f"1/{1.0 / ratio:.0f} of"
        yield gear, f"its stiffness is {words} that of the other gears"


def _no_curve(readings: FleetReadings, sums: MountingSums) -> Iterator[_Fault]:
    """Yield gears whose residuals are far larger than those of others, and no noise."""
    fits, unit = curve_fits(sums), readings.case.units.load_unit
    usual = float(np.median(fits.sd))
    # Readings that are spread evenly have the variance of their range over twelve.
    spread = np.sqrt(12.0 * sums.products[:, 3, 3] / sums.rows)
    far = (fits.sd > _TIMES * usual) & (fits.sd > _SHARE * spread)
    far &= fits.alike * np.sqrt(sums.rows) > _ALIKE
    for gear, sd in zip(sums.gear[far], fits.sd[far], strict=True):
        yield (
            gear,
            f"its readings follow no curve: they leave one by {sd:.2g} {unit} (sd), "
            f"those of the other gears by {usual:.2g} {unit}. A break, a channel that "
            "stood still, or two parts under one label",
        )


def _two_parts(readings: FleetReadings, sums: MountingSums) -> Iterator[_Fault]:
    """Yield gears whose mountings differ far more than those of other gears.

    Mountings of a gear scatter by a robust estimate from n differences within gears, in
    addition to their errors. The median of n has the tails of (n + 1)/2 degrees of
    freedom, and mountings scatter with tails of `_TAILS`.
    """
    several = np.bincount(sums.gear)[sums.gear] > 1
    sums = sums.where(several & (sums.products[:, 0, 0] > 0.0))
    if not len(sums.gear):
        return
    table: Any = _log_stiffness(sums)
    if readings.case.rigs:
        off = table["place"] - table.groupby("gear")["place"].transform("median")
        rig = np.array(readings.case.rigs)[sums.run]
        table["place"] -= off.groupby(rig).transform("median")
    gears = table.sort_values("place").groupby("gear")
    low, high, many = gears.first(), gears.last(), gears.size()
    count = table.groupby("gear")["place"].transform("size")
    off = table["place"] - table.groupby("gear")["place"].transform("mean")
    off = (off * np.sqrt(count / (count - 1.0)))[count > 1]
    own = robust_sd(off.to_numpy()) ** 2 - float(table["variance"].median())
    variance = low["variance"] + high["variance"] + 2.0 * max(own, 0.0)
    gap, scatter = high["place"] - low["place"], np.sqrt(variance)
    chances = max(float((many * (many - 1.0)).sum()), 1.0)
    freedom = min((float((many - 1.0).sum()) + 1.0) / 2.0, _TAILS)
    limit = np.maximum(t.isf(_TWO_PARTS / chances, freedom) * scatter, _SAME)
    labels, usual = readings.case.run_labels, 100.0 * float(scatter.median())
    for gear in gap.index[gap > limit]:
        softer, stiffer = (labels[each["run"][gear]] for each in (low, high))
        yield (
            gear,
            f"mounting {stiffer} is {100.0 * np.expm1(gap[gear]):.2g} % stiffer than "
            f"{softer}, and mountings of other gears differ by {usual:.2g} % (sd): two "
            "parts under one label",
        )


def _log_stiffness(sums: MountingSums) -> pd.DataFrame:
    """Return the logarithm of the stiffness of mountings, and its variance.

    Loop and bend of the usual mounting are taken out.
    """
    fits, square = curve_fits(sums), sums.products[:, 0, 0]
    loop, bend = np.median(fits.residual[:, 1:3], axis=0)
    pull = sums.products[:, 0] @ np.array([0.0, loop, bend, 1.0])
    pull = np.maximum(pull, np.finfo(float).tiny)
    alike = np.clip(np.median(fits.alike), 0.0, MOST_CORRELATION)
    noise = np.maximum(fits.sd, np.median(fits.sd)) ** 2 * widening(alike)
    columns = {"place": np.log(pull / square), "variance": noise * square / pull**2}
    return pd.DataFrame({"gear": sums.gear, "run": sums.run} | columns)


_TESTS = {
    _still: "Read it at two or more in one run, or leave it out",
    _other_unit: "Check the units of its record, and whether it is of this kind",
    _no_curve: "Correct the record, or leave the gear out",
    _two_parts: "Check the label of each mounting",
}
