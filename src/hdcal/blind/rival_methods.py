"""What simpler ways of choosing a cause would say: least squares, effect by effect."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Case
from hdcal.data.priors import effect_priors
from hdcal.evidence.case_evidence import NONE
from hdcal.evidence.piecewise_effect import piecewise_effect
from hdcal.evidence.prepare import PreparedCase, prepare
from hdcal.evidence.subspaces import is_subspace, subspace_effect
from hdcal.physics.effect import Effect

# Slope and offset, the first two columns of the base, have no prior here.
_FREE = 2


@dataclass(frozen=True)
class LeastSquares:
    """The best fit of one effect beside the base, its amplitude free.

    Attributes:
        square: sum of squared residuals [N²].
        parameters: that were fitted, shapes included.
        rows: that it was fitted to.
    """

    square: float
    parameters: int
    rows: int

    @property
    def bic(self) -> float:
        """Bayesian information criterion, up to a constant."""
        spread = max(self.square / self.rows, 1e-300)
        return self.rows * np.log(spread) + self.parameters * np.log(self.rows)


def fit_each(
    case: Case, library: Mapping[str, type[Effect]], noise_sd: float | None = None
) -> dict[str, LeastSquares]:
    """Fit every testable effect on the mean, and none, by least squares.

    Args:
        case: from `read_case`.
        library: effects to fit, by name.
        noise_sd: against which the base's priors count [N]; by default the pilot's.
    """
    prepared = prepare(case, effect_priors(case.gear.full_scale), noise_sd)
    base = _base(prepared)
    reading = prepared.rows.reading
    rows = len(reading)
    padded = np.pad(reading, (0, base.shape[0] - rows))
    left = padded - base @ (base.T @ padded)
    found = {NONE: LeastSquares(float(left @ left), _FREE, rows)}
    for name, effect in library.items():
        if effect.stage == "noise" or effect.needs - case.records.known:
            continue
        if is_subspace(effect, prepared):
            tables = subspace_effect(effect, prepared).columns
            offsets, count = np.zeros((len(tables), rows)), tables.shape[1]
        else:
            pieces = piecewise_effect(effect, prepared)
            tables, offsets = pieces.slopes[:, None], pieces.offsets
            count = 1
        shapes = int(len(tables) > 1)
        square = min(
            _square(base, left, table, offset)
            for table, offset in zip(tables, offsets, strict=True)
        )
        size = _FREE + count + shapes
        found[name] = LeastSquares(square, size, rows)
    return found


def own_form_closure(
    case: Case, name: str, library: Mapping[str, type[Effect]], noise_sd: float
) -> float | None:
    """Return the share of a noise-free gap that an effect of the library can close.

    Args:
        case: whose readings have no noise.
        name: of the effect.
        library: that holds it.
        noise_sd: of the readings whose gap it was [N].

    Returns:
        1 − RMS after over RMS before; None where the effect cannot be tested.
    """
    found = fit_each(case, {name: library[name]}, noise_sd)
    if name not in found or found[NONE].square <= 0.0:
        return None
    return 1.0 - float(np.sqrt(found[name].square / found[NONE].square))


def _base(prepared: PreparedCase) -> np.ndarray:
    """Return orthonormal base columns, each above the rows of the priors.

    Slope and offset are free; what temperature does is held by its prior, else no
    effect of temperature could be told.
    """
    rows = prepared.rows
    held = np.sqrt(rows.precision)
    below = np.diag(np.where(np.arange(len(held)) < _FREE, 0.0, held))
    stacked = np.vstack([rows.base, below])
    left, strength, _ = np.linalg.svd(stacked, full_matrices=False)
    return left[:, strength > 1e-9 * strength[0]]


def _square(base, left, table, offset) -> float:
    """Return the least sum of squares beside the base, of rows padded by priors."""
    width = base.shape[0] - table.shape[-1]
    table, offset = np.pad(table, ((0, 0), (0, width))), np.pad(offset, (0, width))
    error = left - offset + base @ (base.T @ offset)
    columns = table - (table @ base) @ base.T
    solved = np.linalg.lstsq(columns.T, error, rcond=1e-9)[0]
    rest = error - columns.T @ solved
    return float(rest @ rest)
