"""A verdict in sentences that need no statistics to be understood."""

from collections import Counter
from collections.abc import Iterator, Mapping

from hdcal.diagnosis.answer import VerdictAnswer
from hdcal.diagnosis.places import places
from hdcal.diagnosis.verdict import Closure, Which
from hdcal.report.words import (
    estimate,
    hypothesis,
    known,
    label,
    newton,
    or_zero,
    percent,
    percent_span,
    with_unit,
)

_MOST_PAIRS = 4
# Statistics of the test that look at the scatter alone.
_SCATTER = ("p_spread", "p_tails")
PROPORTIONAL = "An effect proportional to deformation is a wrong K, not a gap."
NO_PROOF = (
    "Closing the gap is not proof of cause: another effect of the same shape would "
    "close it as well."
)

# From this probability on, what is the most probable is said without a reserve.
_SURE = 0.9
# A gap of r noise sds in n rows is detected nine times in ten from r √n = 4.2 on.
_DETECTABLE = 4.2


def headline(found: VerdictAnswer) -> str:
    """Return the answer in one sentence."""
    if found.status != "ok":
        return "The diagnosis did not pass its checks and must not be used."
    return _sentences(found)[0]


def next_step(found: VerdictAnswer) -> str | None:
    """Return the run that would tell most, or None."""
    if found.status != "ok" or not found.next_test or nothing_suspected(found):
        return None
    lead = "Next run" if found.which.verdict != "named" else "To be surer"
    return f"{lead}: {found.next_test[0].run.rstrip('.')}."


def nothing_suspected(found: VerdictAnswer) -> bool:
    """Tell whether no gap is seen, so that there is no cause to look for."""
    return found.which.verdict == "none" and not found.gap.detected


def answer(found: VerdictAnswer) -> list[str]:
    """Return the answer in sentences; a failed verdict has none."""
    if found.status != "ok":
        return []
    last = next_step(found)
    return _sentences(found) + ([] if last is None else [last])


def _sentences(found: VerdictAnswer) -> list[str]:
    say = {"none": _none, "named": _named, "ambiguous": _ambiguous}
    return list(say.get(found.which.verdict, _unknown)(found))


def count_words(found: Mapping[str, VerdictAnswer]) -> str:
    """Return how many cases have each verdict."""
    words = Counter(verdict_word(one) for one in found.values())
    return ", ".join(f"{many} {word}" for word, many in words.most_common())


def verdict_word(found: VerdictAnswer) -> str:
    """Return the verdict in a word."""
    return "FAILED" if found.status != "ok" else found.which.verdict


def one_reading(found: VerdictAnswer) -> str:
    """Return what was diagnosed one by one: a reading, or a mean of some."""
    group = found.data.averaged_rows
    return "a reading" if group == 1 else f"a mean of {group} readings"


def limits(found: VerdictAnswer) -> list[str]:
    """Return what this verdict cannot say, in sentences."""
    which = found.which
    return [*_blind(which), PROPORTIONAL, *([NO_PROOF] if _closes(found) else [])]


def _blind(which: Which) -> Iterator[str]:
    if which.not_testable:
        lacking = [
            f"{label(item.effect)} (needs {', '.join(item.needs)})"
            for item in which.not_testable
        ]
        yield f"Not testable with this data: {'; '.join(lacking)}."
    if which.not_excited:
        names = ", ".join(map(label, which.not_excited))
        yield f"Too small to show in this program at a physical size: {names}."
    if which.inseparable:
        yield _alike(which)


def _alike(which: Which) -> str:
    """Name the pairs of one shape, first those that concern the answer."""
    matter = {which.effect, which.second_effect, *which.set}
    pairs = sorted(which.inseparable, key=lambda pair: not matter & {*pair})
    texts = [f"{label(a)} from {label(b)}" for a, b in pairs[:_MOST_PAIRS]]
    rest = len(pairs) - len(texts)
    pairs_word = "pair" if rest == 1 else "pairs"
    more = f", nor {rest} other {pairs_word} (in verdict.json)" if rest else ""
    return f"This program can never tell {', '.join(texts)}{more}."


def _closes(found: VerdictAnswer) -> bool:
    return found.shrink.closed is not None


def _none(found: VerdictAnswer) -> Iterator[str]:
    gap, chance = found.gap, found.which.probabilities.get("none")
    noise = f"the noise of {one_reading(found)} is {newton(gap.noise_sd_N)}"
    if gap.detected:
        yield (
            "Something departs slightly from pure noise (p = "
            f"{_p(found.where.p_value)}), but that the model lacks nothing "
            f"remains the most probable ({percent(chance)}); {noise}."
        )
    else:
        rows = found.data.rows
        yield f"No gap is seen: the model fits all {rows} readings; {noise}."
    if known(gap.noise_sd_N):
        yield f"Too small to be seen here: {_unseen(found)}."


def _unseen(found: VerdictAnswer) -> str:
    """Say how small a gap could go unseen, on average and in a range of deformation."""
    noise, rows = found.gap.noise_sd_N, found.data.rows_diagnosed
    mean = newton(_DETECTABLE * noise / rows**0.5)
    widths = [
        cell.bias_N.hi - cell.bias_N.median
        for cell in found.where.cells
        if cell.covariate == "deformation" and known(cell.bias_N.hi)
    ]
    small = f"a gap of less than about {mean} on average"
    if not widths:
        return small
    low, high = newton(min(widths)), newton(max(widths))
    span = low if low == high else f"{low.removesuffix(' N')} … {high}"
    return f"{small}, or of less than {span} in one range of deformation"


def _named(found: VerdictAnswer) -> Iterator[str]:
    which = found.which
    assert which.effect is not None
    yield _where(found)
    cause = _with_chance(which, which.effect)
    if which.second_effect:
        cause += f" together with {_with_chance(which, which.second_effect)}"
    size = which.amplitude
    if size is None:
        yield f"Most likely cause: {cause}."
    else:
        middle, span = estimate(size)
        middle = with_unit(middle, size.unit)
        name = label(size.parameter.rpartition(".")[2])
        yield f"Most likely cause: {cause}; its {name} is {middle} ({span})."
    yield from _shrinks(found, "it" if not which.second_effect else "them")


def _ambiguous(found: VerdictAnswer) -> Iterator[str]:
    which = found.which
    yield _where(found)
    causes = ", ".join(_with_chance(which, name) for name in which.set)
    yield f"The cause cannot be told with this data; it may be {causes}."
    yield from _shrinks(found, label(which.effect or which.set[0]))


def _unknown(found: VerdictAnswer) -> Iterator[str]:
    chances = found.which.probabilities
    chance = chances.get("unknown")
    others = [name for name in chances if name != "unknown"]
    yield _where(found)
    if not others or not known(chance) or chance >= _SURE:
        yield (
            "Nothing in the library explains it: most likely the cause lies outside "
            f"({percent(chance)})."
        )
    else:
        best = max(others, key=lambda name: or_zero(chances[name]))
        yield (
            f"The cause may lie outside the library ({percent(chance)}); next comes "
            f"{hypothesis(best)} ({percent(chances[best])})."
        )
    yield from _shrinks(found, "the best correction there is")


def _with_chance(which: Which, name: str) -> str:
    chance = which.inclusion.get(name, which.probabilities.get(name))
    return f"{hypothesis(name)} ({percent(chance)})"


def _shrinks(found: VerdictAnswer, what: str) -> Iterator[str]:
    shrink = found.shrink
    closed = shrink.closed
    if closed is None or not known(closed.median):
        return
    if closed.median <= 0.0:
        yield f"Adding {what} does not shrink the gap on {held_out(shrink)}."
        return
    share = percent_span(closed)
    yield f"Adding {what} removes {share} of the gap on {held_out(shrink)}."


def held_out(shrink: Closure) -> str:
    """Return what the correction was tried on, such as half-cycles not fitted to."""
    name = shrink.held_out
    one = name.removeprefix("leave-one-").removesuffix("-out")
    if not one or one == name:
        return "readings that it was not fitted to"
    many = f"{one.replace('_', ' ')}{'es' if one.endswith('ch') else 's'}"
    return f"{many} that it was not fitted to"


def _where(found: VerdictAnswer) -> str:
    step, found_places = found.gap.rounding_N, list(places(found.where))
    if known(step):
        return (
            f"The readings are rounded to steps of {newton(step)}; nothing else sets "
            "them apart from the model."
        )
    if not found_places:
        return _nowhere(found)
    first, *rest = (
        f"{newton(abs(bias))} {'higher' if bias > 0.0 else 'lower'}"
        + ("" if index else " than the calibrated model")
        + f" {words}"
        for index, (words, bias) in enumerate(found_places)
    )
    more = "".join(f", and {text}" for text in rest)
    return f"The measured force is up to {first}{more}."


def _nowhere(found: VerdictAnswer) -> str:
    """Say that no single range is off."""
    where = found.where
    p = _p(where.p_value)
    chances = {n: v for n, v in where.statistics.items() if n.startswith("p_")}
    if min(chances, key=lambda n: or_zero(chances[n]), default="") in _SCATTER:
        return (
            f"The readings depart from the model (p = {p}), but no range of them is "
            "off on average: the departure is in their scatter."
        )
    size = newton(found.gap.rms_N.median)
    return (
        f"The readings depart from the model by {size} rms (p = {p}), but no "
        "single range of them by enough to point at it."
    )


def _p(value: float | None) -> str:
    if not known(value):
        return "–"
    return "below 0.001" if value < 0.001 else f"{value:.2g}"
