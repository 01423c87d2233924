"""The JSON answer about the library of effects."""

from dataclasses import dataclass
from typing import Literal

from hdcal.report.answer import Answer, EffectName, Words


@dataclass(frozen=True)
class ListedParameter:
    """A parameter of an effect.

    Attributes:
        name: of the parameter.
        unit: of its values.
        meaning: in one line.
        null: value at which the effect vanishes, if it is an amplitude.
        prior: that is shipped, in words; None where there is none.
        source: of the prior.
    """

    name: str
    unit: Words
    meaning: Words
    null: float | None
    prior: str | None
    source: str | None


@dataclass(frozen=True)
class ListedEffect:
    """An effect of the library; it cannot do without the covariates that it needs."""

    name: EffectName
    stage: str
    family: str
    needs: tuple[str, ...]
    meaning: Words
    parameters: tuple[ListedParameter, ...]


@dataclass(frozen=True, kw_only=True)
class EffectsAnswer(Answer):
    """What `hdcal effects` answers."""

    schema: Literal["hdcal.effects/1"] = "hdcal.effects/1"
    effects: tuple[ListedEffect, ...]
