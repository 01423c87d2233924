"""One case with what is true of it and what was answered."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from hdcal.blind.label import CaseAnswer, Label
from hdcal.errors import Finding, InputError

NONE, UNKNOWN = "none", "unknown"
# Rounding in a file may move a sum of probabilities by this much.
_SLACK = 1e-3


@dataclass(frozen=True)
class ScoredCase:
    """A label beside an answer to the same case."""

    label: Label
    answer: CaseAnswer

    @property
    def plain_effect(self) -> bool:
        """Whether exactly one effect acts and the library knows it."""
        return self.one_effect and self.label.truth[0] not in self.label.withheld

    @property
    def withheld(self) -> bool:
        """Whether the one effect that acts was taken out of the library."""
        return self.one_effect and self.label.truth[0] in self.label.withheld

    @property
    def one_effect(self) -> bool:
        """Whether exactly one effect acts."""
        return self.label.kind == "effect" and len(self.label.truth) == 1

    @cached_property
    def truth(self) -> str | None:
        """The true hypothesis; None of real data, which has no single one."""
        label = self.label
        if label.kind == "real":
            return None
        if label.kind == "null":
            return NONE
        if label.kind == "outside" or set(label.truth) & set(label.withheld):
            return UNKNOWN
        return sorted_parts("+".join(label.truth))

    @cached_property
    def probabilities(self) -> dict[str, float]:
        """Of all hypotheses, pairs with their parts in alphabetical order.

        What an effect leaves over says nothing of which effect it is.
        """
        found: dict[str, float] = {}
        for name, value in self.answer.probabilities.items():
            name = sorted_parts(without_remainder(name))
            found[name] = found.get(name, 0.0) + value
        return found

    @cached_property
    def top(self) -> str:
        """Most probable hypothesis; that nothing is missing, of who gave none."""
        return (most_probable(self.probabilities) or [NONE])[0]

    @property
    def stated(self) -> str:
        """The one thing that the answer says: none, unknown or the first effect."""
        word = self.answer.verdict
        return word if word in (NONE, UNKNOWN) else self.answer.effect or NONE

    @property
    def top_effect(self) -> str | None:
        """Most probable effect, whatever the verdict; None where no effect has any."""
        return (most_probable(self.answer.inclusion) or [None])[0]

    @property
    def credit(self) -> float:
        """1 where the most probable effect is the true one, 1/k in a tie of k."""
        return credit(self.answer.inclusion, self.label.truth[0])

    @property
    def oracle_credit(self) -> float:
        """The same of the oracle."""
        chances = self.label.oracle
        effects = {k: v for k, v in chances.items() if k not in (NONE, UNKNOWN)}
        return credit(effects, self.label.truth[0])

    @property
    def named(self) -> bool:
        """Whether an effect is named."""
        return self.answer.verdict == "named"

    @property
    def named_right(self) -> bool:
        """Whether the effect that is named is one that acts."""
        return self.named and self.answer.effect in self.label.truth

    @property
    def said(self) -> bool:
        """Whether a group of causes is said, or an effect of it."""
        return self.answer.verdict in ("named", "group")

    def said_right(self, families: Mapping[str, str]) -> bool:
        """Tell whether the group that is said is that of an effect that acts.

        Args:
            families: group of each effect.
        """
        own = {families.get(name, name) for name in self.label.truth}
        effect = self.answer.effect or ""
        groups = self.answer.group or (families.get(effect, effect),)
        found = {*groups} & own or {*self.answer.group_members} & {*self.label.truth}
        return self.said and bool(found)

    def first_group_right(self, families: Mapping[str, str]) -> bool:
        """Tell whether the most probable effect is of the true one's group."""
        first, truth = self.top_effect, self.label.truth[0]
        return first is not None and families.get(first, first) == families.get(
            truth, truth
        )

    def at(self, level: float) -> bool:
        """Tell whether the gap is of one size, within 5 %."""
        return self.between(level, level)

    def between(self, low: float, high: float) -> bool:
        """Tell whether the gap's size lies in a range, its ends widened by 5 %."""
        return 0.95 * low <= self.label.r <= 1.05 * high


Cases = Sequence[ScoredCase]


def null_cases(cases: Cases, noise: str) -> list[ScoredCase]:
    """Return the cases without a gap in one kind of noise.

    Args:
        cases: of any kind.
        noise: iid, ar (serial up to .5), strong (serial beyond) or log.
    """

    def kind(label: Label) -> str:
        strong = label.noise == "ar" and label.correlation > 0.5 + 1e-9
        return "strong" if strong else label.noise

    null = [c for c in cases if c.label.kind == "null"]
    return [c for c in null if kind(c.label) == noise]


def without_remainder(name: str) -> str:
    """Return a hypothesis less what it leaves unknown beside an effect."""
    return "+".join(p for p in name.split("+") if p != UNKNOWN) or name


def sorted_parts(name: str) -> str:
    """Return one spelling of a pair, whichever of the two comes first."""
    return "+".join(sorted(name.split("+")))


def most_probable(chances: Mapping[str, float]) -> list[str]:
    """Return the most probable of some names, all of them in a tie."""
    best = max(chances.values(), default=0.0)
    return sorted(n for n, p in chances.items() if p == best) if best > 0.0 else []


def credit(chances: Mapping[str, float], truth: str) -> float:
    """Return 1 where the most probable name is true, 1/k in a tie of k, else 0."""
    found = most_probable(chances)
    return 1.0 / len(found) if truth in found else 0.0


def match_answers(
    labels: Sequence[Label],
    answers: Sequence[CaseAnswer],
    *,
    name: str,
    all_of_them: bool,
) -> list[ScoredCase]:
    """Return every label with its answer, in the order of the labels.

    Args:
        labels: the truth.
        answers: in any order.
        name: of the diagnoser.
        all_of_them: whether an unanswered case is an error. Who may leave out the
            hard ones scores well.

    Raises:
        InputError: with every case that is unknown, answered twice or not at all,
            and every answer whose probabilities are none.
    """
    problems, found = [], {answer.case: answer for answer in answers}
    cases = [label.case for label in labels]
    known = set(cases)
    if len(known) < len(cases):
        problems.append(("labels", "two labels share a case's name"))
    if len(found) < len(answers):
        problems.append((name, "a case is answered twice"))
    problems += [(name, f"no label for case {c}") for c in found if c not in known]
    if all_of_them:
        problems += [(name, f"no answer to case {c}") for c in cases if c not in found]
    problems += [(name, text) for a in found.values() for text in _faults(a)]
    if problems:
        remedy = "give one answer per case, with probabilities that sum to 1"
        raise InputError(Finding(file, text, remedy) for file, text in problems)
    return [ScoredCase(one, found[one.case]) for one in labels if one.case in found]


def _faults(answer: CaseAnswer) -> list[str]:
    chances = answer.probabilities
    values = [*chances.values(), *answer.inclusion.values()]
    if not all(math.isfinite(v) and -1e-9 <= v <= 1.0 + _SLACK for v in values):
        return [f"case {answer.case} has a probability that is not from 0 to 1"]
    if chances and abs(math.fsum(chances.values()) - 1.0) > _SLACK:
        return [f"the probabilities of case {answer.case} do not sum to 1"]
    return []
