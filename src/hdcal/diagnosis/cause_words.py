"""What is said of the cause of a gap, in sentences."""

from collections.abc import Iterator

from hdcal.diagnosis.answer import VerdictAnswer
from hdcal.diagnosis.groups import JOINED
from hdcal.diagnosis.model_posterior import SURE as NAME
from hdcal.diagnosis.seen_words import what_is_seen
from hdcal.diagnosis.verdict import Closure, NotTestable, Which
from hdcal.evidence.case_evidence import NONE, UNKNOWN
from hdcal.physics.groups import GROUPS
from hdcal.physics.registry import EFFECTS
from hdcal.report.words import (
    capital,
    estimate,
    hypothesis,
    known,
    label,
    or_zero,
    percent,
    percent_span,
    with_unit,
)

# From this probability on, what is the most probable is said without a reserve.
_SURE = 0.9
# Members of a group below this are not listed.
_WORTH_SAYING = 0.01
# Chances of one effect or another make more than this only where both may act.
_ONE = 1.05


def named(found: VerdictAnswer) -> Iterator[str]:
    """Yield what is said of a cause that is named."""
    which = found.which
    assert which.effect is not None
    yield what_is_seen(found)
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
    if which.named == ("run_offset",):
        yield "A calibration gives each mounting a zero of its own already."
    yield from _twins(which)
    yield from _beside(which, label(which.effect))
    yield from _shrinks(found, "it" if not which.second_effect else "them")


def group_of_causes(found: VerdictAnswer) -> Iterator[str]:
    """Yield what is said where a group of causes is all that can be named."""
    which = found.which
    assert which.effect is not None and which.group is not None
    yield what_is_seen(found)
    say = found.units.say
    own = [GROUPS[name] for name in which.group.split(JOINED) if name in GROUPS]
    # What is seen may tell which of two opposite ones it is.
    seen = tuple(each.statement for each in found.seen)
    told = [g for g in own if any(s.startswith(say(g.meaning)) for s in seen)]
    meaning = ", or ".join(group.meaning for group in told or own) or which.group
    likely = [n for n in which.group_members if which.inclusion[n] >= _WORTH_SAYING]
    ranked = sorted(likely, key=lambda name: -which.inclusion[name])
    causes = ", ".join(_with_chance(which, name) for name in ranked)
    # Chances that each one acts: together they are more than one where two may.
    more = "; what acts together counts for each"
    causes += more * (sum(which.inclusion[name] for name in likely) > _ONE)
    yield f"{capital(say(meaning))} ({percent(which.group_probability)}): {causes}."
    others = [n for n in which.named if n not in which.group_members]
    if others:
        told = " and ".join(_with_chance(which, name) for name in others)
        sure = all(which.inclusion[n] >= _SURE for n in others)
        yield f"Together with it {'' if sure else 'most likely '}acts {told}."
    if which.describes_best:
        yield (
            f"{capital(label(which.effect))} alone describes it, but is not named: "
            f"{lookalikes_counted(which)} such cases of blind checks had another cause."
        )
    elif _SURE <= which.inclusion[which.effect] < NAME:
        yield (
            f"{capital(label(which.effect))} is not named: its "
            f"{100.0 * which.inclusion[which.effect]:.1f} % are short of the "
            f"{percent(NAME)} that a name takes."
        )
    for group in own:
        what = "any of these" if len(own) == 1 else f"that {group.meaning}"
        yield say(f"Against {what}: {group.remedy}.")
    for name in others:
        groups = EFFECTS[name].groups if name in EFFECTS else ()
        remedies = [GROUPS[one].remedy for one in groups if GROUPS[one] not in own]
        if remedies:
            yield say(f"Against {label(name)}: {'; '.join(remedies)}.")
    yield from _looks_the_same(which)
    yield from _twins(which)
    yield from _beside(which, label(which.effect))
    both = " and ".join(map(label, which.named))
    yield from _shrinks(found, both)


def lookalikes_counted(which: Which) -> str:
    """Return in how many of the cases of blind checks something else acted."""
    others = round((which.lookalike_rate or 0.0) * which.lookalike_cases)
    return f"{others} of {which.lookalike_cases}"


def _looks_the_same(which: Which) -> Iterator[str]:
    """Say what would look the same and cannot be tested here."""
    if which.lookalikes:
        told = ", ".join(map(with_needs, which.lookalikes))
        yield f"This loading would not tell it from {told}."


def _twins(which: Which) -> Iterator[str]:
    """Say what obeys the same equation as a cause that is told."""
    for name in which.named:
        twin = EFFECTS[name].twin if name in EFFECTS else ""
        if twin:
            within = "gives the same readings within a mounting as"
            yield f"{capital(twin)} {within} {label(name)}."


def with_needs(untestable: NotTestable) -> str:
    """Return an effect with what it would need to be tested."""
    return f"{label(untestable.effect)} (needs {', '.join(untestable.needs)})"


def ambiguous(found: VerdictAnswer) -> Iterator[str]:
    """Yield what is said of several causes."""
    which = found.which
    yield what_is_seen(found)
    chances = {name: or_zero(_chance(which, name)) for name in which.set}
    ranked = sorted(chances, key=lambda name: -chances[name])
    several = sum(chances.values()) > 1.0 + 1e-6
    twice = "; what acts together counts for each" if several else ""
    if which.second_effect:
        pair = {*which.named}
        with_both = [n for n in which.probabilities if pair <= {*n.split("+")}]
        chance = sum(or_zero(which.probabilities[name]) for name in with_both)
        both = " and ".join(map(label, which.named))
        ranked = [name for name in ranked if name not in which.named]
        yield (
            "The cause cannot be told for sure with this data; most likely are "
            f"{both} together ({percent(chance)})."
        )
        lead, what, twice = "Or it may be", both, ""
    else:
        lead = "The cause cannot be told with this data; it may be"
        what = label(which.effect or which.set[0])
    causes = ", ".join(_with_chance(which, name) for name in ranked)
    if ranked:
        yield f"{lead} {causes}{twice}."
    yield from _looks_the_same(which)
    yield from _shrinks(found, what)


def unknown(found: VerdictAnswer) -> Iterator[str]:
    """Yield what is said where the library has no cause."""
    chances = found.which.probabilities
    chance = chances.get("unknown")
    others = [name for name in chances if name != "unknown"]
    together = list(_two_at_once(found.which))
    yield what_is_seen(found)
    if not others or not known(chance) or chance >= _SURE:
        yield (
            f"{'No single effect' if together else 'Nothing'} in the library explains "
            f"all of it: most likely the cause lies outside ({percent(chance)})."
        )
    else:
        best = max(others, key=lambda name: or_zero(chances[name]))
        yield (
            f"The cause may lie outside the library ({percent(chance)}); next comes "
            f"{hypothesis(best)} ({percent(chances[best])})."
        )
    yield from together
    yield from _shrinks(found, "the best correction there is")


def _two_at_once(which: Which) -> Iterator[str]:
    """Say which pair describes the readings best, where none with unknown does better.

    One such pair among hundreds counts little beforehand, and so it comes behind.
    """
    weighed = {n: e for n, e in which.log_evidence.items() if known(e)}
    best = max(weighed, key=lambda name: weighed[name], default=NONE)
    if "+" in best and UNKNOWN not in best.split("+"):
        yield (
            f"Or two effects act at once: nothing describes the readings better than "
            f"{hypothesis(best)}, though few rigs have just these two."
        )


def _beside(which: Which, what: str) -> Iterator[str]:
    """Say what lies beside a cause, where it is likely."""
    rest = which.remainder
    if rest is None or not known(rest.probability) or rest.probability < 0.5:
        return
    yield (
        f"Beside {what} lies something that is not in the library "
        f"({percent(rest.probability)}): {percent_span(rest.share)} of the gap."
    )


def _chance(which: Which, name: str) -> float | None:
    """Return the probability of a hypothesis, of an effect with all beside it."""
    return which.inclusion.get(name, which.probabilities.get(name))


def _with_chance(which: Which, name: str) -> str:
    return f"{hypothesis(name)} ({percent(_chance(which, name))})"


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
