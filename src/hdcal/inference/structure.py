"""What the model of a case contains beside line and effects, decided once.

Two questions are answered before any sampling: do the readings show that neighbours
err alike, and does the curve bend? Each answer is that of the evidence of the
readings, coefficients and noise integrated out. A form that the readings do not show
is left out: where they are independent and straight the model is that of least squares.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from hdcal.data.case import Case
from hdcal.data.records import Records, less_run_means
from hdcal.data.scatter import left_of_lines
from hdcal.inference.discrepancy import (
    BASIS_SIZE,
    build_discrepancy,
    discrepancy_columns,
)
from hdcal.inference.distributions import frozen
from hdcal.inference.noise_form import MOST_SPECIMENS, Pilot, pilot_fit
from hdcal.inference.padding import pad_records
from hdcal.inference.serial_correlation import CORRELATION, previous_rows
from hdcal.physics.effect import Effect

# Largest rounding step, in noise sds, for which Sheppard's correction is used, with an
# error of 2 exp(−2π²·0.71²) ~ 1e-4. That noise is known roughly from few rows, and
# beside a mixture it is that of wild readings too.
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
# Zeros of so many runs have columns; those of more are taken off as means.
_MOST_RUNS = 50


@dataclass(frozen=True)
class ModelStructure:
    """Form of a model beside its effects.

    Attributes:
        noise_sd: left by a pilot fit [N].
        rounded: whether the noise needs the exact likelihood of rounded readings.
        with_gap: whether the leftover discrepancy is in the model.
        correlated: whether the correlation of neighbouring readings is in the model.
        why_independent: why it is not; empty where it is.
    """

    noise_sd: float
    rounded: bool
    with_gap: bool
    correlated: bool
    why_independent: str


def decide_structure(
    case: Case,
    effects: Sequence[type[Effect]] = (),
    with_gap: bool | None = None,
    pilot: Pilot | None = None,
) -> ModelStructure:
    """Return the structure that the readings of a case show.

    Args:
        case: records and gear.
        effects: in the model. What they explain cannot be told from a bend here, so
            that with effects a leftover is in the model only where it is asked for.
        with_gap: whether the leftover discrepancy is in the model; None decides.
        pilot: fit of these records, where there is one.
    """
    noise_sd = (pilot or pilot_fit(case.records)).noise_sd
    # What the gear file states of the correlation is in the model.
    is_stated = case.gear.scale_priors[CORRELATION].family != "uniform"

    def considered(rounded: bool) -> tuple[str, tuple[bool, ...]]:
        reason = _why_independent(case, effects, rounded)
        return reason, (False,) if reason else (True,) if is_stated else _EITHER

    rounded = _needs_exact_rounding(case, effects, noise_sd, bool(with_gap))
    reason, ties = considered(rounded)
    if with_gap is None and (effects or not _may_bend(case)):
        with_gap = False
    gaps = _EITHER if with_gap is None else (with_gap,)
    gap, tied = _best_form(case, bool(effects), gaps, ties)
    coarse = _needs_exact_rounding(case, effects, noise_sd, gap)
    if coarse != rounded:
        # Beside a leftover the steps are taken for noise, which may be correlated.
        rounded = coarse
        reason, ties = considered(rounded)
        gap, tied = _best_form(case, bool(effects), (gap,), ties)
    if not (reason or tied):
        reason = NONE_SHOWN
    return ModelStructure(noise_sd, rounded, gap, tied, reason)


def _best_form(
    case: Case, generous: bool, gaps: tuple[bool, ...], ties: tuple[bool, ...]
) -> tuple[bool, bool]:
    """Return whether there is a leftover and a correlation, of those considered."""
    forms = [(gap, tied) for gap in gaps for tied in ties]
    if len(forms) == 1:
        return forms[0]
    priors = case.gear.scale_priors
    evidence = _Evidence(case.records, priors, generous=generous, with_gap=any(gaps))
    return max(
        forms, key=lambda form: evidence.log_evidence(*form) - sum(form) * _LOG_POSITIVE
    )


def _may_bend(case: Case) -> bool:
    """Return whether rows are enough, and a line misses one by more than its step."""
    if len(case.records.force) < _LEAST_ROWS_OF_A_GAP:
        return False
    base, force = _base(case.records, generous=False)
    left = force - base @ (base.T @ force)
    return float(np.max(np.abs(left))) > case.gear.force_resolution


def _needs_exact_rounding(case: Case, effects, noise_sd: float, with_gap: bool) -> bool:
    # Beside members, which then were not linear, only where nothing else will do.
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
        return "no exact likelihood is known beside noise that is a mixture"
    if rounded:
        return "the steps of the reading are too wide beside the noise"
    return ""


class _Evidence:
    """Evidence of forms of the noise and the curve, from Gram matrices.

    With rows z = [base, leftover, residual] all that a form needs are the sums of
    z zᵀ over rows, over rows that follow another one, and of neighbours.
    """

    def __init__(self, records: Records, priors, *, generous: bool, with_gap: bool):
        base, force = _base(records, generous)
        gap = build_discrepancy(records) if with_gap else None
        shapes = np.empty((len(force), 0))
        if gap is not None:
            shapes = np.asarray(discrepancy_columns(gap, pad_records(records)))
        beside = np.column_stack([shapes[: len(force)], force])
        table = np.hstack([base, beside - base @ (base.T @ beside)])
        before = previous_rows(records)
        follows = before >= 0
        earlier, later = table[before[follows]], table[follows]
        self._all, self._first = table.T @ table, table[~follows].T @ table[~follows]
        self._before, self._now = earlier.T @ earlier, later.T @ later
        crossed = later.T @ earlier
        self._crossed = crossed + crossed.T
        self._rows, self._following = len(force), int(np.count_nonzero(follows))
        self._base = base.shape[1]
        self._alike = _quantiles(priors[CORRELATION], CORRELATION, _CORRELATIONS)
        self._scales: list[np.ndarray] = []
        if gap is not None:
            lengths = _quantiles(priors["gap_length"], "gap_length", _LENGTHS)
            self._scales = [np.asarray(gap.prior_sd(1.0, one)) for one in lengths]

    def log_evidence(self, gap: bool, tied: bool) -> float:
        """Return the log probability of the readings under a form, up to a constant.

        Args:
            gap: whether the leftover discrepancy is in the model.
            tied: whether neighbouring readings are correlated.
        """
        correlations = self._alike if tied else np.zeros(1)
        each = [list(self._given(rho, gap)) for rho in correlations]
        return float(logsumexp(each) - np.log(np.size(each)))

    def _given(self, correlation: float, gap: bool) -> Iterator[float]:
        """Yield log probabilities at the points of the leftover's size and length."""
        gram = self._all
        if correlation > 0.0:
            changed = self._now - correlation * self._crossed
            changed = changed + correlation**2 * self._before
            gram = self._first + changed / (1.0 - correlation**2)
        p, free = self._base, self._rows - self._base
        base, cross, rest = gram[:p, :p], gram[:p, p:], gram[p:, p:]
        rest = rest - cross.T @ np.linalg.solve(base, cross)
        volume = 0.5 * self._following * np.log1p(-(correlation**2))
        volume += 0.5 * np.linalg.slogdet(base)[1]
        square = max(rest[-1, -1], 1e-300)
        if not gap:
            yield -volume - 0.5 * free * np.log(square)
            return
        for scale in self._scales:
            inner = scale[:, None] * rest[:-1, :-1] * scale
            size, turn = np.linalg.eigh(inner)
            size, along = np.maximum(size, 0.0), turn.T @ (scale * rest[:-1, -1])
            for gain in _SIZES**2:
                left = square - np.sum(gain * along**2 / (1.0 + gain * size))
                left = max(left, 1e-12 * square)
                volumes = volume + 0.5 * np.sum(np.log1p(gain * size))
                yield -volumes - 0.5 * free * np.log(left)


def _base(records: Records, generous: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return orthonormal columns of the base model, shape (n, p), and the force [N].

    Args:
        records: the rows.
        generous: also a cubic and a step for the direction, which stand for effects.
    """
    run, specimen = np.asarray(records.run), np.asarray(records.specimen)
    force, place = (
        np.asarray(values, float) for values in (records.force, records.deformation)
    )
    place = (place - place.mean()) / (np.ptp(place) or 1.0)
    rise = np.asarray(records.temperature) - np.mean(records.temperature)
    specimens, runs = np.unique(specimen), np.unique(run)
    many = len(specimens) > MOST_SPECIMENS
    columns = [] if many else [place * (specimen == i) for i in specimens]
    if np.ptp(rise) > 0.0:
        # The modulus falls with the temperature; a drift of the zero is no part of it.
        columns += [rise * np.asarray(records.deformation)]
    if generous:
        columns += [place**2, place**3, np.asarray(records.sense, float), rise]
    if many:
        *columns, force = (left_of_lines(records, one) for one in (*columns, force))
    elif len(runs) <= _MOST_RUNS:
        columns += [(run == i).astype(float) for i in runs]
    else:
        *columns, force = (less_run_means(values, run) for values in (*columns, force))
    table = np.reshape(columns, (-1, len(force))).T
    left, size, _ = np.linalg.svd(table, full_matrices=False)
    return left[:, size > 1e-10 * size.max(initial=0.0)], force


def _quantiles(prior, name: str, count: int) -> np.ndarray:
    """Return quantiles of a prior that stand for it with equal weights."""
    if prior.family == "fixed":
        return np.array([float(prior.numbers[0])])
    return np.asarray(frozen(prior, name).ppf((np.arange(count) + 0.5) / count))
