"""Does the likeliest cause leave only noise? If not, something else is at work.

Evidence compares hypotheses with each other; all of them may be wrong. So the gate is
asked once more, about the readings beside each likely hypothesis, its shape free to
differ as far as evidence lets it. A small p-value moves probability to "unknown".
"""

from dataclasses import replace

import numpy as np
from scipy.special import betainc, betaln

from hdcal.data.case import Case
from hdcal.diagnosis.model_posterior import Weighed, doubted
from hdcal.diagnosis.where import directions_of
from hdcal.evidence.assessment import (
    NONE,
    QUANTISATION,
    UNKNOWN,
    Assessment,
    design_of,
)
from hdcal.evidence.design_matrix import fit_design
from hdcal.evidence.effect_lines import TOLERANCES
from hdcal.evidence.prepare import Setting, reweighted
from hdcal.evidence.residual_test import gate
from hdcal.evidence.whitened_rows import whiten

# Hypotheses as likely as this are looked at, with this many draws of pure noise.
_LIKELY, _DRAWS = 0.1, 600
# Odds, before the data, of something that resembles an effect but is none.
_RESEMBLES = 0.07
# The amplitude is as good as free: it may be this many times what was found.
_FREE = 3.0
# Readings with a noise this much larger than the middle one are noisy.
_NOISY = 1.2


def doubt(
    found: Assessment,
    weighed: Weighed,
    case: Case,
    correlation: float,
    rng: np.random.Generator,
) -> Weighed:
    """Move probability to unknown from hypotheses that leave more than noise.

    Args:
        found: evidences.
        weighed: their posterior.
        case: whose rows were looked at.
        correlation: AR(1) coefficient of the noise.
        rng: source of randomness.

    Source:
        T. Sellke, M. J. Bayarri and J. O. Berger, The American Statistician 55 (2001):
        a p-value speaks for its hypothesis with odds of at least −e p ln p.
    """
    kept = {}
    for name, share in weighed.probabilities.items():
        names = name.split("+")
        # Rounding in steps above the noise leaves a pattern that is no effect.
        if share < _LIKELY or {NONE, UNKNOWN, QUANTISATION} & {*names}:
            continue
        p = _p_value(found, names, case, correlation, rng)
        odds = -np.e * p * np.log(p) if p < np.exp(-1.0) else 1.0
        odds /= max(1.0, _bursts(found, names, correlation))
        # Where there is no surprise nothing is moved.
        kept[name] = min(1.0, odds * (1.0 + _RESEMBLES) / (odds + _RESEMBLES))
    return doubted(weighed, kept)


def _p_value(found: Assessment, names, case: Case, correlation: float, rng) -> float:
    """Return the p-value of the mean beside a hypothesis at its best fit."""
    setting = found.setting
    for name in names:
        if name in found.noise:
            setting = reweighted(setting, found.noise[name].relative_sd)
    setting = _beside(found, setting, names, correlation)
    tested = gate(
        setting, correlation, *directions_of(found, case)[1:], rng, draws=_DRAWS
    )
    return tested.mean_p_value


def _bursts(found: Assessment, names, correlation: float) -> float:
    """Return the odds that noisy readings came in bursts, against one by one.

    Noise, whatever its size in each row, has a sign of its own in each: neighbours
    among the readings that a hypothesis holds for noisy agree as often as not. In a
    burst they agree with a probability that is uniform from one half to one.
    """
    odds = 1.0
    for name in names:
        if name not in found.noise:
            continue
        wide = found.noise[name].relative_sd
        rows = reweighted(found.setting, wide).rows
        fit = fit_design(
            rows, design_of(found, names), found.setting.noise_sd, correlation
        )
        # Serial correlation alone makes neighbours agree.
        left = np.asarray(rows.reading) - fit.predict()
        error = np.asarray(whiten(rows, left[:, None], correlation))[:, 0]
        noisy = wide > _NOISY * np.median(wide)
        before = np.asarray(rows.before)
        both = noisy & (before >= 0) & noisy[before]
        same = int(np.sum(both & (error * error[before] > 0.0)))
        pairs = int(np.sum(both))
        odds *= sign_odds(same, pairs)
    return odds


def sign_odds(same: int, pairs: int) -> float:
    """Return the odds of dependent against independent signs.

    Args:
        same: pairs of neighbours that agree.
        pairs: of neighbours in all.
    """
    other = pairs - same
    whole = betaln(same + 1, other + 1) + np.log(betainc(other + 1, same + 1, 0.5))
    return float(np.exp(whole + (pairs + 1) * np.log(2.0)))


def _beside(found: Assessment, setting: Setting, names, correlation: float) -> Setting:
    """Return the setting whose base also holds what effects may add."""
    rows, design = setting.rows, design_of(found, names)
    if not len(design.columns):
        return setting
    fit = fit_design(rows, design, setting.noise_sd, correlation)
    width = rows.base.shape[1]
    added = fit.contribution(width)
    size = np.abs(fit.mean[width : width + len(design.columns)])
    free = _FREE * size[:, None] * design.columns
    loose = TOLERANCES[-1] * added * rows.tolerance
    columns = np.concatenate([rows.base, free.T, loose.T], axis=1)
    precision = np.full(columns.shape[1], setting.noise_sd**2)
    precision[:width] = rows.precision
    rest = replace(
        rows, reading=rows.reading - design.offset, base=columns, precision=precision
    )
    return replace(setting, rows=rest)
