"""Choice of the model structure: correlated noise and a discrepancy, or neither.

Two questions are answered before any sampling: are the errors of neighbouring readings
correlated, and does the curve bend? The structure with the largest evidence is chosen,
coefficients and noise integrated out. Readings that are independent and straight have
the model of least squares.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdcal.data.case import Case
from hdcal.inference.distributions import quantiles
from hdcal.inference.force_model.discrepancy import (
    BASIS_SIZE,
    build_discrepancy,
    discrepancy_columns,
)
from hdcal.inference.force_model.noise_form import LineFit, fit_lines, pilot_fit
from hdcal.inference.force_model.padding import pad_records
from hdcal.inference.force_model.serial_correlation import (
    CORRELATION,
    previous_rows,
    whitened_products,
)
from hdcal.physics.effect import Effect

# Largest rounding step, in noise sds, for which Sheppard's correction is used, with an
# error of 2 exp(−2π²·0.71²) ~ 1e-4. That noise is known roughly from few rows, and
# with a mixture it includes that of outliers.
_FINE_STEP, _FINE_STEP_OF_FEW, _FINE_STEP_OF_A_MIXTURE = 1.3, 0.5, 1e-3
_FEW_ROWS = 500
# Three readings for each function of a discrepancy: with fewer its priors would
# separate bend from noise. A line counts both as noise, and has a wider interval.
_LEAST_ROWS_OF_A_GAP = 3 * BASIS_SIZE
# What a further part of the model needs: positive evidence, 3 : 1 (Kass and Raftery,
# Journal of the American Statistical Association 90, 1995).
_LOG_POSITIVE = np.log(3.0)
# Why a possible correlation is not in the model.
NONE_SHOWN = "the readings show none"
# Nodes of the hyperparameters: correlation as quantiles of its prior, size of the
# discrepancy in noise sds, its length as quantiles of its prior.
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
    a discrepancy is in the model only on request, by `with_gap`.
    """
    noise_sd = pilot_fit(case.records).noise_sd
    lines = fit_lines(case.records, "bend" if effects else "line")
    if with_gap is None and (effects or not _may_bend(case, lines)):
        with_gap = False
    gaps = (False, True) if with_gap is None else (with_gap,)
    forms = [form for gap in gaps for form in _forms(case, effects, noise_sd, gap)]
    return forms[0] if len(forms) == 1 else _most_evident(case, lines, forms)


def _forms(case: Case, effects, noise_sd: float, gap: bool) -> list[ModelStructure]:
    """Return the possible structures with a discrepancy, or without one."""
    rounded = _needs_exact_rounding(case, effects, noise_sd, gap)
    reason = _why_independent(case, effects, rounded)
    independent = ModelStructure(noise_sd, rounded, gap, False, reason or NONE_SHOWN)
    if reason:
        return [independent]
    correlated = replace(independent, correlated=True, why_independent="")
    # What the gear file states of the correlation is in the model.
    is_stated = case.gear.scale_priors[CORRELATION].family != "uniform"
    return [correlated] if is_stated else [independent, correlated]


def _may_bend(case: Case, lines: LineFit) -> bool:
    """Return whether rows are enough, and a line misses one by more than its step."""
    if len(case.records.force) < _LEAST_ROWS_OF_A_GAP:
        return False
    return float(np.max(np.abs(lines.residual))) > case.gear.force_resolution


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


def _most_evident(
    case: Case, lines: LineFit, forms: Sequence[ModelStructure]
) -> ModelStructure:
    """Return the structure with the largest evidence."""
    records, priors = case.records, case.gear.scale_priors
    others, scales = lines.force[:, None], []
    if any(form.with_gap for form in forms):
        gap = build_discrepancy(records)
        shapes = np.asarray(discrepancy_columns(gap, pad_records(records)))
        others = np.column_stack([shapes[: len(others)], others])
        lengths = quantiles(priors["gap_length"], _LENGTHS, "gap_length")
        scales = [np.asarray(gap.prior_sd(1.0, length)) for length in lengths]
    columns = lines.columns
    table = np.hstack([columns, others - columns @ (columns.T @ others)])
    before, width = previous_rows(records), columns.shape[1]
    rho = quantiles(priors[CORRELATION], _CORRELATIONS, CORRELATION)

    def log_evidence(form: ModelStructure) -> float:
        at = rho if form.correlated else np.zeros(1)
        used = scales if form.with_gap else []
        evidences = [
            log_det + log_evidence
            for gram, log_det in zip(*whitened_products(table, before, at), strict=True)
            for log_evidence in _log_evidences(gram, width, len(table), used)
        ]
        mean = np.logaddexp.reduce(evidences) - np.log(len(evidences))
        return mean - (form.with_gap + form.correlated) * _LOG_POSITIVE

    return max(forms, key=log_evidence)


def _log_evidences(
    gram: np.ndarray, width: int, rows: int, scales: Sequence[np.ndarray]
) -> Iterator[float]:
    """Yield the log evidence of the rows at each node, up to a constant.

    Coefficients of the lines, noise and weights of the discrepancy are integrated out.
    `gram` has the products of the whitened columns: lines, discrepancy, force; `scales`
    the prior sd of each weight for a discrepancy of size one, at each of its lengths.
    """
    base, cross, rest = gram[:width, :width], gram[:width, width:], gram[width:, width:]
    rest = rest - cross.T @ np.linalg.solve(base, cross)
    log_det, free = np.linalg.slogdet(base)[1], rows - width
    square = max(rest[-1, -1], 1e-300)
    if not scales:
        yield -0.5 * (log_det + free * np.log(square))
    for scale in scales:
        products = scale[:, None] * rest[:-1, :-1] * scale
        eigenvalues, eigenvectors = np.linalg.eigh(products)
        eigenvalues = np.maximum(eigenvalues, 0.0)
        along = eigenvectors.T @ (scale * rest[:-1, -1])
        for gain in _SIZES**2:
            left = square - np.sum(gain * along**2 / (1.0 + gain * eigenvalues))
            left = max(left, 1e-12 * square)
            log_dets = log_det + np.sum(np.log1p(gain * eigenvalues))
            yield -0.5 * (log_dets + free * np.log(left))
