"""One case: its label and an answer to it."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.blind.label import NONE, OUTSIDE, Answer, Cause, Label

# Least probability in a log score: no case may weigh more than log 1e-6 = −13.8.
FLOOR = 1e-6
# Probability from which on a class is stated to act, and that of a credible set.
STATED, CREDIBLE = 0.9, 0.9


@dataclass(frozen=True)
class ScoredCase:
    """A label and the answer of one diagnoser to the same case."""

    label: Label
    answer: Answer

    @property
    def one_effect(self) -> bool:
        """Whether exactly one effect acts and the library contains it."""
        return self.label.kind == "effect" and not self.label.withheld

    @property
    def withheld(self) -> bool:
        """Whether the one effect that acts was taken out of the library."""
        return self.label.kind == "effect" and bool(self.label.withheld)

    @property
    def truth(self) -> str | None:
        """The true explanation; None of composites and of measured data.

        What explains most of a composite depends on its parts, and measured data may
        have several causes.
        """
        if self.label.kind in ("composite", "real"):
            return None
        if self.label.kind == "outside" or self.withheld:
            return OUTSIDE
        return "+".join(self.label.truth) or NONE

    @property
    def top(self) -> str:
        """Most probable explanation, of several the first by name."""
        chances = self.answer.explanations
        return min(chances, key=lambda name: (-chances[name], name))

    @property
    def credit(self) -> float:
        """1 where the most probable effect is the true one, 1/k in a tie of k."""
        chances = self.answer.inclusion
        best = max(chances.values(), default=0.0)
        first = [n for n, p in chances.items() if p == best and p > 0.0]
        return 1.0 / len(first) if self.label.truth[0] in first else 0.0

    @property
    def class_first(self) -> bool:
        """Whether the likeliest class contains the true effect."""
        best = max(
            self.answer.classes, key=lambda each: each.acts, default=Cause((), 0.0)
        )
        return self.holds_truth(best)

    @property
    def merged_set(self) -> int:
        """Number of explanations with 90 %, where effects of a class are one."""
        first = {
            n: each.members[0] for each in self.answer.classes for n in each.members
        }
        chances: Counter[frozenset[str]] = Counter()
        for name, chance in self.answer.explanations.items():
            chances[frozenset(first.get(n, n) for n in name.split("+"))] += chance
        total = np.cumsum([chance for _, chance in chances.most_common()])
        return int(np.searchsorted(total, CREDIBLE)) + 1

    def holds_truth(self, cause: Cause) -> bool:
        """Return whether an effect of a class acts."""
        return not {*cause.members}.isdisjoint(self.label.truth)

    @property
    def true_class(self) -> Cause:
        """The likeliest class with an effect that acts, of no members without one."""
        found = [cause for cause in self.answer.classes if self.holds_truth(cause)]
        return max(found, key=lambda cause: cause.acts, default=Cause((), 0.0))

    def stated(self, level: float = STATED) -> list[Cause]:
        """Return classes that are stated to act; none where the explanation misfits."""
        if not self.answer.fits:
            return []
        return [cause for cause in self.answer.classes if cause.acts >= level]

    @property
    def truth_stated(self) -> bool:
        """Whether the true effect, or a class with it, is stated to act."""
        return any(map(self.holds_truth, self.stated()))

    def claims(self, level: float) -> list[tuple[float, bool]]:
        """Return classes of a probability or more: it, and whether an effect acts."""
        return [
            (cause.acts, self.holds_truth(cause))
            for cause in self.answer.classes
            if cause.acts >= level
        ]

    @property
    def outside_acts(self) -> bool:
        """Whether something outside the library more probably acts than not."""
        return self.answer.outside.acts > 0.5

    @property
    def set_holds(self) -> bool:
        """Whether an explanation of the 90 % set contains the true effect."""
        return any(self.label.truth[0] in n.split("+") for n in self.answer.set)

    @property
    def log_score(self) -> float:
        """Log probability of the true explanation [nat]; 0 is perfect."""
        chance = self.answer.explanations.get(self.truth or "", 0.0)
        return math.log(min(max(chance, FLOOR), 1.0))

    def at(self, r: float) -> bool:
        """Return whether the gap is of a size, within 5 %."""
        return 0.95 * r <= self.label.r <= 1.05 * r

    def at_least(self, r: float) -> bool:
        """Return whether the gap is of a size or larger, within 5 %."""
        return self.label.r >= 0.95 * r


Cases = Sequence[ScoredCase]
