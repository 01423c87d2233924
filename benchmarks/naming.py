"""Which effects may be named, and how often names are right: from opened blind checks.

    python -m benchmarks.naming --learn SET [SET …] --test SET [SET …]

Prints the content of `hdcal/diagnosis/naming.toml`, and what the answers rest on as
comments. A set that was learned from tests nothing: the two have to be different ones.
"""

import argparse
import json
from collections.abc import Iterable, Iterator
from pathlib import Path

from hdcal.blind.answer_files import AnswerFiles
from hdcal.blind.diagnosers import families
from hdcal.blind.label import Label
from hdcal.blind.scoring.scored_case import ScoredCase, match_answers
from hdcal.blind.sealed_set import read_set
from hdcal.diagnosis.naming import Naming, Tally

_BY = "hdcal"


def scored(folder: str) -> list[ScoredCase]:
    """Return the cases of an opened set with what hdcal answered."""
    found = read_set(folder)
    plain = json.loads((found.folder / "result" / "labels.json").read_text())
    labels = [Label.from_plain(one["label"]) for one in plain["labels"]]
    _, answers = AnswerFiles(found, _BY).frozen()
    return match_answers(labels, answers, name=_BY, all_of_them=True)


def called(cases: Iterable[ScoredCase]) -> dict[str, Tally]:
    """Return of each effect that alone described cases how often another acted."""
    counts: dict[str, list[int]] = {}
    for case in cases:
        effect, alone = case.answer.effect, case.answer.second_effect is None
        if effect and alone and (case.named or case.answer.describes_best):
            own = counts.setdefault(effect, [0, 0])
            own[0] += 1
            own[1] += effect not in {*case.label.truth} - {*case.label.withheld}
    return {name: Tally(*counts[name]) for name in sorted(counts)}


def tally(right: Iterable[bool]) -> Tally:
    """Return how many there are, and how many are wrong."""
    every = list(right)
    return Tally(len(every), every.count(False))


def by_mechanism(cases: Iterable[ScoredCase], right: Iterable[bool]) -> Tally:
    """Return the same of mechanisms: one is wrong where any of its cases is."""
    found: dict[tuple[str, ...], bool] = {}
    for case, good in zip(cases, right, strict=True):
        mechanism = case.label.kind, *case.label.truth, case.label.beside
        found[mechanism] = found.get(mechanism, True) and good
    return tally(found.values())


def lines(learn: list[ScoredCase], test: list[ScoredCase]) -> Iterator[str]:
    """Yield the lines of the file."""
    found = called(learn)
    rule = Naming(found, Tally(0, 0), Tally(0, 0))
    left_out = [name for name in found if not rule.may_be_named(name)]
    yield f"# {len(learn)} cases to learn from, {len(test)} others to test on."
    yield f"# Not named: {', '.join(left_out) or 'none'}."
    own = [c for c in test if not c.label.withheld]
    named = [c for c in own if c.named]
    said = [c for c in own if c.said and not c.named]
    groups = families()
    for word, some, right in (
        ("names", named, [c.named_right for c in named]),
        ("groups", said, [c.said_right(groups) for c in said]),
    ):
        of_cases, of_those = tally(right), by_mechanism(some, right)
        yield (
            f"# {word}: at most {of_cases.at_most:.1%} wrong, of mechanisms "
            f"{of_those.wrong} of {of_those.said} (at most {of_those.at_most:.1%})"
        )
        yield f"{word} = [{of_cases.said}, {of_cases.wrong}]"
    withheld = [c for c in test if c.label.withheld]
    yield f"# Withheld: {sum(c.named for c in withheld)} of {len(withheld)} named."
    yield "[called]"
    for name, counted in found.items():
        yield f"{name} = [{counted.said}, {counted.wrong}]"


def main() -> None:
    """Print the file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--learn", nargs="+", required=True, metavar="SET")
    parser.add_argument("--test", nargs="+", required=True, metavar="SET")
    given = parser.parse_args()
    if {Path(one).resolve() for one in given.learn} & {
        Path(one).resolve() for one in given.test
    }:
        parser.error("a set to learn from cannot be the test as well")
    learn, test = ([c for one in s for c in scored(one)] for s in vars(given).values())
    print("\n".join(lines(learn, test)))


if __name__ == "__main__":
    main()
