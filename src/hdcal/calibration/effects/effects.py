"""The library of effects: what each one means, what it needs and its priors."""

from typing import Literal

from hdcal.data.priors import effect_priors
from hdcal.data.records import FEATURE_WORDS
from hdcal.physics.effect import parameters
from hdcal.physics.registry import EFFECTS
from hdcal.report.item import EffectName, Item, Words
from hdcal.report.result import Result
from hdcal.report.words import prior_words


class ListedParameter(Item):
    """A parameter of an effect, with its shipped prior in words, if there is one.

    `null` is the value at which the effect vanishes, of an amplitude.
    """

    name: str
    unit: Words
    meaning: Words
    null: float | None
    prior: str | None
    source: str | None


class ListedEffect(Item):
    """An effect of the library, with the covariates that it needs."""

    name: EffectName
    stage: str
    family: str
    needs: tuple[str, ...]
    meaning: Words
    parameters: tuple[ListedParameter, ...]


class Effects(Result):
    """The library of effects."""

    template = "calibration/effects/report.md.j2"
    table = "effects"

    format: Literal["hdcal.effects/1"] = "hdcal.effects/1"
    effects: tuple[ListedEffect, ...]


def effects() -> Effects:
    """Return every effect of the library with its parameters."""
    priors, listed = effect_priors(), []
    for name, effect in EFFECTS.items():
        rows = []
        for field, spec in parameters(effect).items():
            site = f"{name}.{field}"
            prior = priors.get(site)
            row = ListedParameter(
                name=field,
                unit=spec.unit,
                meaning=spec.meaning,
                null=spec.null,
                prior=prior_words(site, prior) if prior else None,
                source=prior.source if prior else None,
            )
            rows.append(row)
        listed_effect = ListedEffect(
            name=name,
            stage=effect.stage,
            family=effect.family,
            needs=tuple(sorted(FEATURE_WORDS.get(n, n) for n in effect.needs)),
            meaning=(effect.__doc__ or "").strip().split("\n")[0],
            parameters=tuple(rows),
        )
        listed.append(listed_effect)
    return Effects(effects=tuple(listed))
