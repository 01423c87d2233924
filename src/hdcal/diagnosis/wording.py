"""Effects, and shares of the gap, in the words of an engineer."""

from collections.abc import Sequence

from hdcal.evidence.noise_models import GROWING, OUTLIERS
from hdcal.report.item import Interval
from hdcal.report.words import label

_WORDS = {
    GROWING: "noise that grows with the load",
    OUTLIERS: "wild readings",
    "coulomb_friction": "Coulomb friction",
}
# From this share on an effect explains all of the gap, and below the other nothing
# that counts.
ALL, _LITTLE = 0.99, 0.01
# Names of a class in a sentence: where there are more, two and the number of others.
_MOST = 3


def on_noise(name: str) -> bool:
    """Whether an effect acts on the noise, not on the mean reading."""
    return name in (GROWING, OUTLIERS)


def effect_words(name: str) -> str:
    """Return what an effect is called in a sentence."""
    return _WORDS.get(name, label(name))


def together(effects: Sequence[str]) -> str:
    """Return effects that act together, those on the noise last."""
    return " + ".join(map(effect_words, sorted(effects, key=on_noise)))


def either(members: Sequence[str], most: int = _MOST) -> str:
    """Return effects that cannot be separated: `a, b or c`.

    Args:
        members: their names, the most probable first.
        most: names; where there are more, the last is the number of the others.
    """
    words = [*map(effect_words, members)]
    if len(words) > most:
        others = len(words) - most + 1
        words = [*words[: most - 1], f"one of {others} others"]
    *first, last = words
    return f"{', '.join(first)} or {last}" if first else last


def share_words(share: Interval) -> str:
    """Return a share of the gap with its interval."""
    ends = [round(100.0 * end) for end in (share.lo, share.hi)]
    if share.median >= ALL:
        least = f" (at least {ends[0]} %)" if ends[0] < 100 else ""
        return f"all of the gap{least}"
    if share.hi < 1.5 * _LITTLE:
        return "less than 2 % of the gap"
    return f"{round(100.0 * share.median)} % ({ends[0]} … {ends[1]} %) of the gap"
