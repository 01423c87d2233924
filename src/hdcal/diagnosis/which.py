"""Which effects act: classes of effects, explanations, and the answer in a word."""

from typing import Any, Literal

from pydantic import computed_field

from hdcal.diagnosis.wording import either, on_noise, share_words, together
from hdcal.report.item import EffectName, Interval, Item, Probability, Words

# From this probability on an effect is said to act, and to be named.
LIKELY, NAMED = 0.5, 0.9
# A gap matters from this rms on, as a share of the largest force: the error of
# interpolation that ISO 376 allows its best class of force gauges, 00.
MATTERS = 2.5e-4
# Least p-value of an explanation that fits.
ADEQUATE = 0.01

VerdictWord = Literal["none", "named", "group", "ambiguous", "unknown"]


class Cause(Item):
    """Effects that this loading cannot separate, the likeliest first.

    Attributes:
        members: their names; none of something outside the library.
        probability: that one of them acts, alone, in a pair, or beside something else.
        explains: share of the gap's rms that they close where they act; None of effects
            on the noise.
    """

    members: tuple[EffectName, ...]
    probability: Probability
    explains: Interval | None

    @property
    def on_noise(self) -> bool:
        """Whether they act on the noise, not on the mean reading."""
        return any(map(on_noise, self.members))

    @property
    def merged(self) -> bool:
        """Whether they are several."""
        return len(self.members) > 1

    @property
    def words(self) -> str:
        """The effects in a sentence."""
        return either(self.members)

    def columns(self) -> dict[str, Any]:
        """Return the columns of a table, the names of the effects first."""
        return {"effects": " or ".join(self.members) or "outside"} | super().columns()

    @property
    def share(self) -> str:
        """The share of the gap in a sentence; empty where none is known."""
        return share_words(self.explains) if self.explains else ""


class Explanation(Item):
    """Effects that together explain the readings.

    Attributes:
        effects: none where nothing acts.
        outside: whether they leave most of the gap to something outside the library.
        probability: of this explanation.
    """

    effects: tuple[EffectName, ...]
    outside: bool
    probability: Probability

    @property
    def nothing(self) -> bool:
        """Whether nothing acts."""
        return not (self.effects or self.outside)

    @property
    def words(self) -> str:
        """The explanation in a sentence."""
        if self.outside:
            return "something outside the library"
        return together(self.effects) or "no gap"


class Which(Item):
    """Which effects cause the gap.

    Attributes:
        verdict: in a word.
        causes: classes of effects, the most probable first.
        outside: something outside the library.
        explanations: the smallest set of them with 90 %.
        inclusion: probability that each effect acts.
        fits: whether the likeliest explanation fits.
        p_value: of the check of its residuals.
        not_testable: effects that predict nothing here, with what was not measured.
    """

    verdict: VerdictWord
    causes: tuple[Cause, ...]
    outside: Cause
    explanations: tuple[Explanation, ...]
    inclusion: dict[EffectName, Probability]
    fits: bool
    p_value: Probability
    not_testable: dict[EffectName, tuple[Words, ...]]

    @computed_field
    @property
    def effect(self) -> EffectName | None:
        """The effect that acts most probably, on the mean reading where one does."""
        if self.verdict in ("none", "unknown"):
            return None
        on_mean = [name for each in self.on_mean for name in each.members]
        return max(on_mean or self.inclusion, key=lambda name: self.inclusion[name])

    @computed_field
    @property
    def group_members(self) -> tuple[EffectName, ...]:
        """Effects of the class that holds `effect`."""
        members = (each.members for each in self.causes if self.effect in each.members)
        return next(members, ())

    @computed_field
    @property
    def set(self) -> tuple[Words, ...]:
        """Effects of the explanations, or `none` and `unknown`, likeliest first."""
        names = [
            name
            for each in self.explanations
            for name in (("unknown",) if each.outside else each.effects or ("none",))
        ]
        return tuple(dict.fromkeys(names))

    @property
    def acting(self) -> tuple[Cause, ...]:
        """Classes that more probably act than not."""
        return tuple(each for each in self.causes if each.probability > LIKELY)

    @property
    def on_mean(self) -> tuple[Cause, ...]:
        """Acting classes on the mean reading, those that explain most first."""
        found = [each for each in self.acting if not each.on_noise]
        return tuple(sorted(found, key=_explained, reverse=True))

    @property
    def on_noise(self) -> tuple[Cause, ...]:
        """Acting effects on the noise."""
        return tuple(each for each in self.acting if each.on_noise)


def _explained(cause: Cause) -> float:
    return cause.explains.median if cause.explains else 0.0
