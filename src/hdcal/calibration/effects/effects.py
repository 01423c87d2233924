"""The library of effects: what each one means, what it needs and its priors."""

from collections.abc import Mapping
from typing import Literal

from hdcal.data.prior import Prior
from hdcal.data.priors import effect_priors
from hdcal.physics.effect import Effect, parameters
from hdcal.physics.registry import EFFECTS
from hdcal.report.item import EffectName, Item, Words
from hdcal.report.result import Result
from hdcal.report.words import prior_words


class ListedParameter(Item):
    """A parameter of an effect.

    Attributes:
        name: of the parameter.
        unit: of its values.
        meaning: in one line.
        null: value at which the effect vanishes, if it is an amplitude.
        prior: shipped prior in words; None where there is none.
        source: of the prior.
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
    priors = effect_priors()
    listed = (_listed(name, effect, priors) for name, effect in EFFECTS.items())
    return Effects(effects=tuple(listed))


def _listed(
    name: str, effect: type[Effect], priors: Mapping[str, Prior]
) -> ListedEffect:
    found = []
    for field, declared in parameters(effect).items():
        site = f"{name}.{field}"
        prior = priors.get(site)
        found.append(
            ListedParameter(
                name=field,
                unit=declared.unit,
                meaning=declared.meaning,
                null=declared.null,
                prior=prior_words(site, prior) if prior else None,
                source=prior.source if prior else None,
            )
        )
    return ListedEffect(
        name=name,
        stage=effect.stage,
        family=effect.family,
        needs=tuple(sorted(effect.needs)),
        meaning=(effect.__doc__ or "").strip().split("\n")[0],
        parameters=tuple(found),
    )
