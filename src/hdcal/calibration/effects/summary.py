"""The library of effects as an answer."""

from collections.abc import Mapping

from hdcal.calibration.effects.answer import (
    EffectsAnswer,
    ListedEffect,
    ListedParameter,
)
from hdcal.calibration.effects.document import headline
from hdcal.data.prior import Prior
from hdcal.data.priors import effect_priors
from hdcal.physics.effect import Effect, parameters
from hdcal.physics.registry import EFFECTS
from hdcal.report.words import prior_words


def effects_answer() -> EffectsAnswer:
    """Return every effect of the library with its parameters, ready for JSON."""
    priors = effect_priors()
    listed = tuple(_listed(name, effect, priors) for name, effect in EFFECTS.items())
    return EffectsAnswer(
        status="ok",
        reasons=(),
        headline=headline(len(listed)),
        next_step=None,
        effects=listed,
    )


def _listed(
    name: str, effect: type[Effect], priors: Mapping[str, Prior]
) -> ListedEffect:
    found = []
    for field, declared in parameters(effect).items():
        site = f"{name}.{field}"
        prior = priors.get(site)
        words, source = None, None
        if prior is not None:
            words, source = prior_words(site, prior), prior.source
        meaning, null = declared.meaning, declared.null
        one = ListedParameter(field, declared.unit, meaning, null, words, source)
        found.append(one)
    return ListedEffect(
        name=name,
        stage=effect.stage,
        family=effect.groups[0],
        needs=tuple(sorted(effect.needs)),
        meaning=(effect.__doc__ or "").strip().split("\n")[0],
        parameters=tuple(found),
    )
