"""What the model of a case contains besides line and effects, decided once.

Two questions are answered before any sampling: are the errors of neighbouring readings
correlated, and does the curve bend? Each answer is that of the evidence of the
readings, coefficients and noise integrated out. A form that the readings do not show
is left out: where they are independent and straight the model is that of least squares.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Case
from hdcal.inference.distributions import quantiles
from hdcal.inference.force_model.discrepancy import (
    BASIS_SIZE,
    build_discrepancy,
    discrepancy_columns,
)
from hdcal.inference.force_model.noise_form import BaseForces, base_model, pilot_fit
from hdcal.inference.force_model.padding import pad_records
from hdcal.inference.force_model.serial_correlation import (
    CORRELATION,
    previous_rows,
    whitened_products,
)
from hdcal.physics.effect import Effect

# Largest rounding step, in noise sds, for which Sheppard's correction is used, with an
# error of 2 exp(−2π²·0.71²) ~ 1e-4. That noise is known roughly from few rows, and
# with a mixture it is that of wild readings too.
_FINE_STEP, _FINE_STEP_OF_FEW, _FINE_STEP_OF_A_MIXTURE = 1.3, 0.5, 1e-3
_FEW_ROWS = 500
# Three readings for each function of a leftover: of fewer its priors would decide what
# is bend and what is noise. A line then has both as its noise, and a wider interval.
_LEAST_ROWS_OF_A_GAP = 3 * BASIS_SIZE
# What a further part of the model needs: positive evidence, 3 : 1 (Kass and Raftery,
# Journal of the American Statistical Association 90, 1995).
_LOG_POSITIVE = np.log(3.0)
# Why a correlation that could be is not in the model.
NONE_SHOWN = "the readings show none"
# Without and with.
_EITHER = (False, True)
# Points of the hyperparameters: correlation as quantiles of its prior, size of the
# leftover in noise sds, its length as quantiles of its prior.
_CORRELATIONS, _LENGTHS = 8, 4
_SIZES = np.logspace(-0.5, 3.0, 8)


@dataclass(frozen=True)
class ModelStructure:
    """Form of a model apart from its effects."""

    # Left by a pilot fit [N].
    noise_sd: float
    # Whether the noise needs the exact likelihood of rounded readings.
    rounded: bool
    with_gap: bool
    correlated: bool
    why_independent: str


def decide_structure(
    case: Case, effects: Sequence[type[Effect]] = (), with_gap: bool | None = None
) -> ModelStructure:
    """Return the structure that the readings of a case show.

    What effects explain cannot be distinguished from a bend here, so that with effects
    a leftover is in the model only on request, by `with_gap`.
    """
    noise_sd = pilot_fit(case.records).noise_sd
    base = base_model(case.records, "bend" if effects else "line")
    # What the gear file states of the correlation is in the model.
    is_stated = case.gear.scale_priors[CORRELATION].family != "uniform"

    def considered(rounded: bool) -> tuple[str, tuple[bool, ...]]:
        reason = _why_independent(case, effects, rounded)
        return reason, (False,) if reason else (True,) if is_stated else _EITHER

    rounded = _needs_exact_rounding(case, effects, noise_sd, bool(with_gap))
    reason, choices = considered(rounded)
    if with_gap is None and (effects or not _may_bend(case, base)):
        with_gap = False
    gaps = _EITHER if with_gap is None else (with_gap,)
    gap, correlated = _best_form(case, base, gaps, choices)
    coarse = _needs_exact_rounding(case, effects, noise_sd, gap)
    if coarse != rounded:
        # With a leftover the steps are taken for noise, which may be correlated.
        rounded = coarse
        reason, choices = considered(rounded)
        gap, correlated = _best_form(case, base, (gap,), choices)
    if not (reason or correlated):
        reason = NONE_SHOWN
    return ModelStructure(noise_sd, rounded, gap, correlated, reason)


def _may_bend(case: Case, base: BaseForces) -> bool:
    """Return whether rows are enough, and a line misses one by more than its step."""
    if len(case.records.force) < _LEAST_ROWS_OF_A_GAP:
        return False
    return float(np.max(np.abs(base.residual))) > case.gear.force_resolution


def _needs_exact_rounding(case: Case, effects, noise_sd: float, with_gap: bool) -> bool:
    # With members, which then were not linear, only where nothing else will do.
    members = with_gap or case.records.known & {"run", "specimen"}
    few = len(case.records.force) <= _FEW_ROWS and not members
    fine = _FINE_STEP_OF_FEW if few else _FINE_STEP
    if any(effect.mixture for effect in effects):
        fine = _FINE_STEP_OF_A_MIXTURE
    return case.gear.force_resolution > fine * noise_sd


def _why_independent(case: Case, effects, rounded: bool) -> str:
    """Return why no correlation of neighbours can be in the model, empty if it can."""
    prior, records = case.gear.scale_priors[CORRELATION], case.records
    if prior.family == "fixed" and float(prior.numbers[0]) == 0.0:
        return "its prior says that there is none"
    if not np.any(previous_rows(records) >= 0):
        return "no reading follows another one in its run"
    if any(effect.mixture for effect in effects):
        return "no exact likelihood is known for correlated noise that is a mixture"
    if rounded:
        return "the steps of the reading are wide compared with the noise"
    return ""


def _best_form(
    case: Case, base: BaseForces, gaps: tuple[bool, ...], choices: tuple[bool, ...]
) -> tuple[bool, bool]:
    """Return whether there is a leftover and a correlation, of those considered."""
    forms = [(gap, correlated) for gap in gaps for correlated in choices]
    if len(forms) == 1:
        return forms[0]
    records, priors = case.records, case.gear.scale_priors
    others, scales = base.force[:, None], []
    if any(gaps):
        gap = build_discrepancy(records)
        shapes = np.asarray(discrepancy_columns(gap, pad_records(records)))
        others = np.column_stack([shapes[: len(others)], others])
        lengths = quantiles(priors["gap_length"], _LENGTHS, "gap_length")
        scales = [np.asarray(gap.prior_sd(1.0, length)) for length in lengths]
    columns = base.columns
    table = np.hstack([columns, others - columns @ (columns.T @ others)])
    before, width = previous_rows(records), columns.shape[1]
    rho = quantiles(priors[CORRELATION], _CORRELATIONS, CORRELATION)

    def log_evidence(form: tuple[bool, bool]) -> float:
        products = whitened_products(table, before, rho if form[1] else np.zeros(1))
        chances = [
            volume + chance
            for gram, volume in zip(*products, strict=True)
            for chance in _log_chances(
                gram, width, len(table), scales if form[0] else []
            )
        ]
        mean = np.logaddexp.reduce(chances) - np.log(len(chances))
        return mean - sum(form) * _LOG_POSITIVE

    return max(forms, key=log_evidence)


def _log_chances(
    gram: np.ndarray, width: int, rows: int, scales: Sequence[np.ndarray]
) -> Iterator[float]:
    """Yield log probabilities of the rows, up to a constant.

    Coefficients of the base, noise and weights of the leftover are integrated out.
    `gram` has the products of the whitened columns: base, leftover, force; `scales` the
    prior sd of each weight of the leftover for a size of one, at each of its lengths.
    """
    base, cross, rest = gram[:width, :width], gram[:width, width:], gram[width:, width:]
    rest = rest - cross.T @ np.linalg.solve(base, cross)
    volume, free = 0.5 * np.linalg.slogdet(base)[1], rows - width
    square = max(rest[-1, -1], 1e-300)
    if not scales:
        yield -volume - 0.5 * free * np.log(square)
    for scale in scales:
        strength, turn = np.linalg.eigh(scale[:, None] * rest[:-1, :-1] * scale)
        strength, along = np.maximum(strength, 0.0), turn.T @ (scale * rest[:-1, -1])
        for gain in _SIZES**2:
            left = square - np.sum(gain * along**2 / (1.0 + gain * strength))
            left = max(left, 1e-12 * square)
            volumes = volume + 0.5 * np.sum(np.log1p(gain * strength))
            yield -volumes - 0.5 * free * np.log(left)
