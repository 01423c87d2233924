"""Whether model and measurement part, what is seen of it and where: typed values."""

from dataclasses import dataclass

import numpy as np

from hdcal.data.records import Records
from hdcal.report.answer import Count, Probability, Real, Words
from hdcal.report.intervals import Interval


@dataclass(frozen=True)
class Gap:
    """Whether model and measurement part, and by how much.

    Attributes:
        detected: the residual test is significant at 5 %.
        probability: posterior probability that anything is missing (1 − P(none)).
        rms_N: root mean square of the gap at the tested rows, 95 % interval; NaN
            where none is detected.
        noise_sd_N: of a reading, without the gap.
        share_of_full_scale: rms over the largest tested force [-].
        autocorrelation: posterior mean of the noise's AR(1) coefficient [-].
        rounding_N: step of rounded readings, where nothing else is detected.
    """

    detected: bool
    probability: Probability
    rms_N: Interval
    noise_sd_N: Real
    share_of_full_scale: Real
    autocorrelation: Real
    rounding_N: Real | None = None


@dataclass(frozen=True)
class Cell:
    """One pre-declared cell of the rows and the mean residual in it.

    Attributes:
        covariate: deformation, temperature, time, angle, direction, run, specimen
            or a product such as `direction × deformation`.
        label: for people, such as "0.36 … 0.54 mm" or "unloading".
        from_: lower end in `unit`; NaN for labels.
        to: upper end; NaN for labels.
        unit: mm, °C, s, rad or "".
        rows: number of rows.
        bias_N: mean reading minus calibrated model, with the simultaneous 95 % band of
            noise around it.
        z: bias over its standard error under no gap.
        share: of the squared gap that lies in this cell [-].
    """

    covariate: Words
    label: str
    from_: Real
    to: Real
    unit: str
    rows: Count
    bias_N: Interval
    z: Real
    share: Real

    @property
    def hot(self) -> bool:
        """Whether the bias leaves the simultaneous band."""
        return self.bias_N.lo > 0.0 or self.bias_N.hi < 0.0


@dataclass(frozen=True)
class CovariateShare:
    """Part of the gap's variance along one covariate, 95 % interval."""

    covariate: Words
    share: Interval


@dataclass(frozen=True)
class Where:
    """Where the gap lies.

    Attributes:
        p_value: family-wise, of the residual test.
        statistics: largest |z| over the cells and of the noise's shape, by name.
        cells: every pre-declared cell.
        shares: of the gap's variance by covariate; empty when no gap is detected.
        residual_N: reading minus calibrated base model, shape (n,).
        gap_N: smooth part of it (posterior mean), shape (n,).
        records: the rows that were looked at: of the case, or means of neighbours.
    """

    p_value: float
    statistics: dict[str, float]
    cells: tuple[Cell, ...]
    shares: tuple[CovariateShare, ...]
    residual_N: np.ndarray
    gap_N: np.ndarray
    records: Records

    def values_of(self, covariate: str) -> np.ndarray | None:
        """Return a covariate at each row; None of a product or of what was not read."""
        if covariate == "angle":  # its ranges are those of one turn
            return np.mod(self.records.angle, 2.0 * np.pi)
        return getattr(self.records, covariate, None)

    def by_covariate(self) -> tuple[dict[str, list[Cell]], dict[str, list[Cell]]]:
        """Return the cells that have ends, deformation first, and those with a name.

        Products come last.
        """
        ranges: dict[str, list[Cell]] = {"deformation": []}
        names: dict[str, list[Cell]] = {}
        for cell in sorted(self.cells, key=lambda cell: "×" in cell.covariate):
            placed = np.isfinite([cell.from_, cell.to]).all()
            kind = ranges if placed and "×" not in cell.covariate else names
            kind.setdefault(cell.covariate, []).append(cell)
        return ranges, names

    @property
    def regions(self) -> tuple[Cell, ...]:
        """Return the hot cells, largest |z| first."""
        return tuple(sorted((c for c in self.cells if c.hot), key=lambda c: -abs(c.z)))


@dataclass(frozen=True)
class Seen:
    """What readings show, whatever its cause.

    Attributes:
        statement: in words.
        covariate: with which it goes.
        size_N: from its lowest to its highest place, simultaneous 95 % interval.
        p_value: adjusted for all that was looked for.
        material: it is more than a thousandth of the largest force.
    """

    statement: Words
    covariate: Words
    size_N: Interval
    p_value: Probability
    material: bool
