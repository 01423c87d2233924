"""What takes the energy of a swing: viscous damping, dry friction, or both.

Where the linear model leaves more than noise, three models are weighed by their
evidence, each as probable as the others before the data. To sample with friction takes
long: unasked it is only named.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from hdcal.data.case import Case, Theory
from hdcal.data.prior import Prior
from hdcal.errors import Finding, InputError
from hdcal.inference import laplace
from hdcal.inference.checks import Check
from hdcal.inference.dynamic_problem import (
    DynamicProblem,
    build_dynamic,
    dynamic_site_priors,
)
from hdcal.motion.friction_search import FrictionSearch, predict
from hdcal.physics.effect import Effect
from hdcal.physics.effects.coulomb_friction import CoulombFriction

# Longer records keep the linear model: the response with friction is sequential.
MOST_ROWS = 4000
# Names of the checks without which no model is named: of what was sampled, and of what
# was weighed. Residuals less probable than this are not noise.
WHITENESS, LEFT_OVER = "residuals are noise", "the likeliest loss leaves noise"
WHITE = 1e-3
# With residuals of the linear model as likely as this nothing else is looked for.
NOISE = 0.05
_LAGS = 20
_FRICTIONAL = (CoulombFriction,)


@dataclass(frozen=True)
class Chosen:
    """The model that is sampled, and what was weighed beside it.

    Attributes:
        problem: data, priors and effects.
        priors: of every site, with their sources.
        whitening: its mode and curvature.
        probabilities: of each model; empty where none was weighed.
        checks: what is to be said of that.
    """

    problem: DynamicProblem
    priors: dict[str, Prior]
    whitening: laplace.Whitening
    probabilities: dict[str, float]
    checks: tuple[Check, ...] = ()


def loss_effects(names: Sequence[str]) -> tuple[type[Effect], ...]:
    """Look up the effects that a moving gear can have.

    Raises:
        InputError: it cannot have one of them.
    """
    others = sorted({*names} - {CoulombFriction.name})
    if others:
        words = f"the model of a moving gear does not hold '{', '.join(others)}'"
        remedy = f"It holds {CoulombFriction.name} only: leave the others out"
        raise InputError([Finding("effects", words, remedy)])
    return _FRICTIONAL if names else ()


def choose_loss(
    case: Case,
    theory: Theory,
    viscous: DynamicProblem,
    mode: laplace.Whitening,
    effects: Sequence[str] | None,
) -> Chosen:
    """Return the model to sample: the linear one, unless friction is asked for.

    Args:
        case: of the record.
        theory: which stiffness K multiplies.
        viscous: the linear model.
        mode: its mode and curvature.
        effects: asked for; None to weigh what else takes the energy, where the linear
            model leaves more than noise.
    """
    own = dynamic_site_priors(case, theory)
    linear = Chosen(viscous, own, mode, {})
    if effects is None and _noise_at(viscous, mode) >= NOISE:
        return linear
    if effects is None and viscous.count > MOST_ROWS:
        return replace(linear, checks=(_too_long(viscous.count),))
    if effects is not None and not loss_effects(effects):
        return linear
    priors = dynamic_site_priors(case, theory, _FRICTIONAL)
    start = FrictionSearch(
        viscous, mode, build_dynamic(case, priors, theory, _FRICTIONAL)
    )
    both = start.both, start.fit_both()
    if effects is not None:
        return Chosen(both[0], priors, both[1], {})
    models = {
        "viscous": (viscous, mode),
        "dry friction": (start.dry, start.fit_dry()),
        "both": both,
    }
    evidence = {name: laplace.log_evidence(*fit) for name, fit in models.items()}
    weights = {n: np.exp(e - max(evidence.values())) for n, e in evidence.items()}
    shares = {n: float(w / sum(weights.values())) for n, w in weights.items()}
    likeliest = max(shares, key=lambda name: shares[name])
    left = _left_over(likeliest, _noise_at(*models[likeliest]))
    return replace(linear, probabilities=shares, checks=(left,))


def _noise_at(problem: DynamicProblem, mode: laplace.Whitening) -> float:
    return noise_probability(problem, laplace.values_at(problem, mode.centre))


def noise_probability(problem: DynamicProblem, values) -> float:
    """Return how probable residuals so correlated are if they are white noise.

    The test is Ljung and Box's over twenty lags (fewer in short records).
    """
    left = problem.deformation - np.asarray(predict(problem, values))
    left = left[: problem.count]
    left = left - left.mean()
    rows = len(left)
    lags = np.arange(1, min(_LAGS, rows // 4) + 1)
    power = max(float(left @ left), np.finfo(float).tiny)
    share = np.array([left[lag:] @ left[:-lag] for lag in lags]) / power
    statistic = rows * (rows + 2) * np.sum(share**2 / (rows - lags))
    return float(stats.chi2.sf(statistic, len(lags)))


def _left_over(name: str, p: float) -> Check:
    if p >= WHITE:
        return Check(LEFT_OVER, "passed", f"{name}: no correlation (p = {p:.2g})")
    words = f"with {name} what is left over is correlated from row to row (p = {p:.1g})"
    return Check(LEFT_OVER, "warning", f"{words}: no loss is named")


def _too_long(rows: int) -> Check:
    words = (
        f"nobody looked for dry friction: in records of more than {MOST_ROWS} rows, as "
        f"this one of {rows}, all damping counts as viscous"
    )
    return Check("the loss is weighed", "note", words)
