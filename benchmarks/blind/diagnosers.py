"""Who can answer a case: hdcal, and simpler ways of choosing a cause as floors."""

import math
from collections.abc import Callable, Mapping

import hdcal
from benchmarks.blind.label import NONE, OUTSIDE, Answer, Cause, Quantiles
from benchmarks.blind.rivals import fit_each
from hdcal.diagnosis import which
from hdcal.diagnosis.decision import Decision, decide
from hdcal.evidence.search import search
from hdcal.physics.effect import Effect
from hdcal.report.item import Interval

Library = Mapping[str, type[Effect]]
Diagnoser = Callable[[hdcal.Case, Library], Answer]
COARSE = "quantisation"
# Effects of less probability are not stated by floors.
_LEAST = 0.01


def by_hdcal(case: hdcal.Case, library: Library) -> Answer:
    """Answer as `hdcal diagnose` decides."""
    return answer_of(case.name, decide(search(case, library)), library)


def answer_of(case: str, found: Decision, library: Library) -> Answer:
    """Return what a decision says as an answer."""
    # That readings are coarse is a fact, and an explanation where nothing else acts.
    coarse, acts = found.coarse_step > 0.0 and COARSE in library, found.which
    plain = COARSE if coarse else NONE
    chances = {_text(e, plain): e.probability for e in found.explanations}
    classes = [_cause(each.members, each) for each in acts.causes]
    inclusion = {name: acts.inclusion.get(name, 0.0) for name in library}
    if coarse:
        inclusion[COARSE] = chances.get(COARSE, 0.0)
        classes.append(Cause((COARSE,), inclusion[COARSE]))
    return Answer(
        case=case,
        gap=1.0 if coarse else found.gap,
        explanations=chances,
        set=tuple(_text(each, plain) for each in acts.explanations),
        inclusion=inclusion,
        classes=tuple(classes),
        outside=_cause((OUTSIDE,), acts.outside),
        gap_N=_quantiles(found.gap_N),
        fits=acts.fits,
    )


def _text(found: which.Explanation, plain: str) -> str:
    return OUTSIDE if found.outside else "+".join(found.effects) or plain


def _cause(members: tuple[str, ...], found: which.Cause) -> Cause:
    return Cause(members, found.probability, _quantiles(found.explains))


def _quantiles(found: Interval | None) -> Quantiles | None:
    return (found.median, found.lo, found.hi) if found else None


def by_none(case: hdcal.Case, library: Library) -> Answer:
    """Answer that there is no gap, whatever the data say."""
    return _single(case, library, {NONE: 1.0})


def by_r2(case: hdcal.Case, library: Library) -> Answer:
    """Answer with the effect that fits best in sample."""
    found = fit_each(case, library)
    best = min((n for n in found if n != NONE), key=lambda name: found[name].square)
    return _single(case, library, {best: 1.0})


def by_bic(case: hdcal.Case, library: Library) -> Answer:
    """Answer with the weights of the Bayesian information criterion."""
    found = {name: fit.bic for name, fit in fit_each(case, library).items()}
    least = min(found.values())
    odds = {name: math.exp(-0.5 * (bic - least)) for name, bic in found.items()}
    total = sum(odds.values())
    return _single(case, library, {name: each / total for name, each in odds.items()})


def _single(case: hdcal.Case, library: Library, chances: dict[str, float]) -> Answer:
    """Return the answer of a method that knows single effects and none only."""
    ranked = sorted(chances, key=lambda name: -chances[name])
    total, credible = 0.0, []
    while total < 0.9:
        credible.append(ranked[len(credible)])
        total += chances[credible[-1]]
    stated = [name for name in ranked if name != NONE and chances[name] >= _LEAST]
    return Answer(
        case=case.name,
        gap=1.0 - chances.get(NONE, 0.0),
        explanations=chances,
        set=tuple(credible),
        inclusion={name: chances.get(name, 0.0) for name in library},
        classes=tuple(Cause((name,), chances[name]) for name in stated),
    )


DIAGNOSERS: dict[str, Diagnoser] = {
    "hdcal": by_hdcal,
    "bic": by_bic,
    "r2": by_r2,
    "none": by_none,
}
