"""Which effects act: classes of effects, explanations, and their sentences."""

from collections.abc import Sequence
from typing import Any, Literal

from pydantic import computed_field

from hdcal.evidence.noise_models import GROWING, OUTLIERS
from hdcal.report.item import EffectName, Interval, Item, Probability, Words
from hdcal.report.words import label

# From this probability on an effect is reported as acting.
LIKELY = 0.5
# A gap matters from this rms on, as a share of the largest force: the error of
# interpolation that ISO 376 allows its best class of force gauges, 00.
MATTERS = 2.5e-4
# Names of a class in a sentence: where there are more, two and the number of others.
_MOST = 3
ON_NOISE = (GROWING, OUTLIERS)

VerdictWord = Literal["none", "named", "group", "ambiguous", "unknown"]


def together(effects: Sequence[str]) -> str:
    """Return effects that act together, those on the noise last."""
    return " + ".join(map(label, sorted(effects, key=ON_NOISE.__contains__)))


def either(members: Sequence[str]) -> str:
    """Return effects that are not separated in a sentence: `a, b or c`."""
    words = [*map(label, members)]
    if len(words) > _MOST:
        others = len(words) - _MOST + 1
        words = [*words[: _MOST - 1], f"one of {others} other effects"]
    *first, last = words
    return f"{', '.join(first)} or {last}" if first else last


def share_words(share: Interval) -> str:
    """Return a share of the gap with its interval."""
    # z: a rounded zero has no sign.
    ends = share.median, share.lo, share.hi
    median, low, high = (f"{100.0 * end:z.0f}" for end in ends)
    return f"{median} % ({low} … {high} %) of the gap"


class Cause(Item):
    """Effects that this loading cannot separate, the likeliest first.

    None are something outside the library. The probability is that one of them acts;
    they then explain a share of the gap's rms. The share is None of effects on the
    noise, and where there is more probably no gap.
    """

    members: tuple[EffectName, ...]
    probability: Probability
    explains: Interval | None

    @property
    def on_noise(self) -> bool:
        """Whether they act on the noise, not on the mean reading."""
        return any(name in ON_NOISE for name in self.members)

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
    """Effects that together explain the readings; none where nothing acts.

    `outside`: they leave most of the gap to something outside the library.
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

    `causes` are classes of effects, `explanations` the smallest set with 90 %; `fits`
    and `p_value` check the residuals of the likeliest. Effects that are not testable
    predict nothing here, for what was not measured.
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
        shares = {c: c.explains.median if c.explains else 0.0 for c in found}
        return tuple(sorted(found, key=lambda each: -shares[each]))

    @property
    def leaders(self) -> tuple[EffectName, ...]:
        """The likeliest effect of each acting class on the mean reading."""
        return tuple(each.members[0] for each in self.on_mean)

    @property
    def mostly_outside(self) -> bool:
        """Whether something outside acts and explains more than any acting effect."""
        if self.outside.probability <= LIKELY:
            return False
        if not self.on_mean:
            return True
        most, rest = self.on_mean[0].explains, self.outside.explains
        return bool(most and rest and rest.median > most.median)

    @property
    def on_noise(self) -> tuple[Cause, ...]:
        """Acting effects on the noise."""
        return tuple(each for each in self.acting if each.on_noise)
