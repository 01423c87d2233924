"""What takes the energy of a swing: viscous damping, dry friction, or both.

Where the linear model leaves more than noise, or noise would hide a gear that rubs,
three models are weighed by their evidence, each as probable as the others before the
data. To sample with friction takes long: unasked it is only named.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from hdcal.data.case import Case, Theory
from hdcal.data.prior import Prior
from hdcal.errors import Finding, InputError
from hdcal.inference import laplace
from hdcal.inference.checks import Check
from hdcal.motion.dynamic_priors import dynamic_site_priors
from hdcal.motion.dynamic_problem import DynamicProblem, build_dynamic
from hdcal.motion.friction_search import (
    FrictionSearch,
    predict,
    rubbing_contrast,
)
from hdcal.physics.effect import Effect
from hdcal.physics.effects.loops import CoulombFriction

# Longer records keep the linear model: the response with friction is sequential.
MOST_ROWS = 4000
# Names of the checks without which no model is named: of what was sampled, and of what
# was weighed. Residuals less probable than this are not noise.
WHITENESS, LEFT_OVER = "residuals are noise", "the likeliest loss leaves noise"
# And of what else was looked for.
LOOKED = "dry friction would show"
_NOBODY = "nobody looked for dry friction, all damping counts as viscous"
WHITE = 1e-3
# Where the linear model leaves noise and a gear that only rubs would differ from it by
# this many noise sds, nothing else is looked for.
PLAIN = 20.0
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
        effects: asked for; None to weigh what else takes the energy, unless the linear
            model leaves noise and a gear that rubs would show.

    Raises:
        InputError: rows are too far apart for a model with friction.
    """
    linear = Chosen(viscous, dynamic_site_priors(case, theory), mode, {})
    if effects is not None and not loss_effects(effects):
        return linear
    values = laplace.values_at(viscous, mode.centre)
    gap = _gap(viscous, float(values["natural_frequency"]))
    if gap and effects is not None:
        raise InputError([Finding(case.name, gap, "Leave coulomb_friction out")])
    if gap:
        return replace(linear, checks=(Check(LOOKED, "note", f"{_NOBODY}: {gap}"),))
    priors = dynamic_site_priors(case, theory, _FRICTIONAL)
    frictional = build_dynamic(case, priors, theory, _FRICTIONAL)
    if effects is not None:
        search = FrictionSearch(viscous, mode, frictional)
        return Chosen(search.both, priors, search.fit_both(), {})
    contrast = rubbing_contrast(viscous, frictional, values)
    if contrast >= PLAIN and noise_probability(viscous, values) >= WHITE:
        words = f"a gear that only rubs would differ by {contrast:.2g} noise sds"
        return replace(linear, checks=(Check(LOOKED, "passed", words),))
    if viscous.count > MOST_ROWS:
        words = f"{_NOBODY}: more than {MOST_ROWS} rows, {viscous.count}"
        return replace(linear, checks=(Check(LOOKED, "note", words),))
    return _weighed(linear, frictional)


def _weighed(linear: Chosen, frictional: DynamicProblem) -> Chosen:
    """Return the linear model with the probability of each model of the loss."""
    search = FrictionSearch(linear.problem, linear.whitening, frictional)
    models = {"viscous": (linear.problem, linear.whitening)}
    # What the gear file states of the damping ratio no model may contradict.
    if frictional.priors["damping_ratio"].family != "fixed":
        models["dry friction"] = search.dry, search.fit_dry()
    models["both"] = search.both, search.fit_both()
    evidence = {name: laplace.log_evidence(*fit) for name, fit in models.items()}
    weights = {n: np.exp(e - max(evidence.values())) for n, e in evidence.items()}
    shares = {n: float(w / sum(weights.values())) for n, w in weights.items()}
    likeliest = max(shares, key=lambda name: shares[name])
    checks = [_left_over(likeliest, _noise_at(*models[likeliest]))]
    if likeliest != "viscous":
        words = (
            "what was sampled is the linear model, in which friction counts as "
            "damping: its intervals are too narrow"
        )
        checks.append(Check("the loss is in the model", "warning", words))
    return replace(linear, probabilities=shares, checks=tuple(checks))


def _gap(problem: DynamicProblem, frequency: float) -> str:
    """Return what is wrong where rows are half a period apart or more, else nothing."""
    longest = float(np.max(np.diff(problem.time[: problem.count])))
    if longest * frequency < 0.5:
        return ""
    return f"rows are up to {longest:.3g} s apart, which is half a period or more"


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
    return float(chdtrc(len(lags), statistic))


def _left_over(name: str, p: float) -> Check:
    if p >= WHITE:
        return Check(LEFT_OVER, "passed", f"{name}: no correlation (p = {p:.2g})")
    words = f"with {name} what is left over is correlated from row to row (p = {p:.1g})"
    return Check(LEFT_OVER, "warning", f"{words}: no loss is named")
