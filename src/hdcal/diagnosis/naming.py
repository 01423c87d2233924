"""What the name of an effect is worth: how often it was right in blind checks.

A cause that no library holds inherits the name of the effect that looks like it,
however clear the evidence. How often that happens is counted where the truth is known.
On one blind check it is learned which effects may be named, on a later one the names
are tested (after Angelopoulos et al., Learn then Test, 2021, arXiv:2110.01052).
"""

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from scipy.special import betaincinv

# An effect whose name other causes get more often than this is not named.
_MOST_OTHERS = 0.15
# Before anything is counted: of five cases half of one is by another cause.
_BEFORE = 0.5, 5
_CONFIDENCE = 0.95


@dataclass(frozen=True)
class Tally:
    """How often something was said in blind checks, and how often it was wrong."""

    said: int
    wrong: int

    @property
    def rate(self) -> float:
        """Share that is wrong, of what was said at least once."""
        return self.wrong / self.said

    @property
    def at_most(self) -> float:
        """Share that is wrong at most, with a confidence of 95 % (Clopper, Pearson)."""
        right = self.said - self.wrong
        return float(betaincinv(self.wrong + 1, right, _CONFIDENCE)) if right else 1.0


@dataclass(frozen=True)
class Naming:
    """What was counted.

    Attributes:
        called: of each effect that alone described cases, in how many of them
            something else acted, an effect that was withheld included.
        names: names on the rounds in which they were tested, no effect withheld.
        groups: groups there, likewise.
    """

    called: dict[str, Tally]
    names: Tally
    groups: Tally

    def may_be_named(self, effect: str) -> bool:
        """Tell whether few enough other causes get this name, as far as is known."""
        found = self.called.get(effect, Tally(0, 0))
        wrong, said = found.wrong + _BEFORE[0], found.said + _BEFORE[1]
        return wrong / said <= _MOST_OTHERS


def naming_file() -> str:
    """Return the text of the file with what was counted."""
    return files("hdcal.diagnosis").joinpath("naming.toml").read_text("utf-8")


@cache
def naming() -> Naming:
    """Return what was counted on the rounds that `docs/blind-check.md` lists."""
    table = tomllib.loads(naming_file())
    called = {name: Tally(*counts) for name, counts in table["called"].items()}
    return Naming(called, Tally(*table["names"]), Tally(*table["groups"]))
