"""One case: its label and an answer to it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from benchmarks.blind.label import NONE, UNKNOWN, Answer, Label
from benchmarks.blind.rig.outside import LISTED

# Least probability in a log score: no case may weigh more than log 1e-6 = −13.8.
FLOOR = 1e-6


@dataclass(frozen=True)
class ScoredCase:
    """A label and an answer to the same case.

    Attributes:
        label: the truth.
        answer: of one diagnoser.
        groups: group of each effect of the library.
    """

    label: Label
    answer: Answer
    groups: Mapping[str, str]

    @property
    def one_effect(self) -> bool:
        """Whether exactly one effect acts and the library contains it."""
        return self.label.kind == "effect" and not self.label.withheld

    @property
    def withheld(self) -> bool:
        """Whether the one effect that acts was taken out of the library."""
        return self.label.kind == "effect" and bool(self.label.withheld)

    @property
    def listed(self) -> bool:
        """Whether a mechanism outside the library was specified with the targets."""
        return self.label.truth[0] in LISTED

    @property
    def noise(self) -> str:
        """Kind of noise: iid, ar (serial up to 0.5), strong (serial beyond) or log."""
        strong = self.label.noise == "ar" and self.label.correlation > 0.5
        return "strong" if strong else self.label.noise

    @property
    def truth(self) -> str | None:
        """The true hypothesis; None of measured data, which has several."""
        label = self.label
        if label.kind == "real":
            return None
        if label.kind == "null":
            return NONE
        if label.kind == "outside" or label.withheld:
            return UNKNOWN
        return "+".join(sorted(label.truth))

    @cached_property
    def probabilities(self) -> dict[str, float]:
        """Of all hypotheses, an effect with a remainder counted for the effect."""
        found: dict[str, float] = {}
        for name, value in self.answer.probabilities.items():
            parts = [part for part in name.split("+") if part != UNKNOWN]
            name = "+".join(sorted(parts)) or name
            found[name] = found.get(name, 0.0) + value
        return found

    @property
    def top(self) -> str:
        """Most probable hypothesis, of several the first by name."""
        return min(self.probabilities, key=lambda n: (-self.probabilities[n], n))

    @property
    def credit(self) -> float:
        """1 where the most probable effect is the true one, 1/k in a tie of k."""
        chances = self.answer.inclusion
        best = max(chances.values(), default=0.0)
        first = [n for n, p in chances.items() if p == best and p > 0.0]
        return 1.0 / len(first) if self.label.truth[0] in first else 0.0

    @property
    def group_credit(self) -> bool:
        """Whether the most probable effect is of the true one's group."""
        chances = self.answer.inclusion
        first = min(chances, key=lambda name: (-chances[name], name), default="")
        right = self.group_of(first) == self.group_of(self.label.truth[0])
        return chances.get(first, 0.0) > 0.0 and right

    def group_of(self, effect: str) -> str:
        """Return the group of an effect."""
        return self.groups.get(effect, effect)

    @property
    def set_holds(self) -> bool:
        """Whether the 90 % set contains the true effect."""
        return self.label.truth[0] in self.answer.set

    @property
    def named(self) -> bool:
        """Whether an effect is named."""
        return self.answer.verdict == "named"

    @property
    def named_right(self) -> bool:
        """Whether the named effect is one that acts."""
        return self.named and self.answer.effect in self.label.truth

    @property
    def stated(self) -> bool:
        """Whether an effect or a group is stated as the cause."""
        return self.answer.verdict in ("named", "group")

    @property
    def stated_right(self) -> bool:
        """Whether the stated group is that of an effect that acts."""
        answer, truth = self.answer, {*self.label.truth}
        groups = {*answer.group} or {self.group_of(answer.effect or "")}
        right = groups & {self.group_of(name) for name in truth}
        return self.stated and bool(right or truth & {*answer.group_members})

    @property
    def log_score(self) -> float:
        """Log probability of the truth [nat]; 0 is perfect."""
        chance = self.probabilities.get(self.truth or "", 0.0)
        return math.log(min(max(chance, FLOOR), 1.0))

    @property
    def brier_score(self) -> float:
        """Squared distance of the probabilities from the truth, 0 to 2."""
        names = {*self.probabilities, self.truth}
        chance = self.probabilities.get
        return math.fsum((chance(n, 0.0) - (n == self.truth)) ** 2 for n in names)

    def at(self, r: float, high: float | None = None) -> bool:
        """Tell whether the gap is of a size, or between two, within 5 %."""
        return 0.95 * r <= self.label.r <= 1.05 * (r if high is None else high)


Cases = Sequence[ScoredCase]
