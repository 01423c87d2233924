"""A verdict in sentences that need no statistics to be understood."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping

from hdcal.diagnosis.answer import VerdictAnswer
from hdcal.diagnosis.cause_words import (
    ambiguous,
    group_of_causes,
    lookalikes_counted,
    named,
    unknown,
    with_needs,
)
from hdcal.diagnosis.seen_words import p_words, what_is_seen
from hdcal.diagnosis.verdict import Which
from hdcal.inference.serial_correlation import worth
from hdcal.report.words import (
    estimate,
    known,
    label,
    load,
    percent,
)

_MOST_PAIRS = 4
PROPORTIONAL = "An effect proportional to {displacement} is a wrong K, not a gap."
NO_PROOF = (
    "Closing the gap is not proof of cause: another effect of the same shape would "
    "close it as well."
)

_WITHOUT_A_RUN = (
    "Calibrate with a gap: its bands hold what no effect of the library explains. Of a "
    "cause that it does not have it cannot say what to measure."
)

# A correlation of neighbours from which on it is told.
_ALIKE = 0.5
# A gap of r noise sds in n independent rows is detected nine times in ten from
# r √n = 4.2 on.
_DETECTABLE = 4.2


def headline(found: VerdictAnswer) -> str:
    """Return the answer in one sentence."""
    if found.status != "ok":
        return "The diagnosis did not pass its checks and must not be used."
    return _sentences(found)[0]


def next_step(found: VerdictAnswer) -> str | None:
    """Return the run that would tell most, or what to do without one."""
    if found.status != "ok" or nothing_suspected(found):
        return None
    if not found.next_test:
        return _WITHOUT_A_RUN if found.which.verdict == "unknown" else None
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
    say = {
        "none": _none,
        "named": named,
        "group": group_of_causes,
        "ambiguous": ambiguous,
    }
    said = list(say.get(found.which.verdict, unknown)(found))
    if found.stiffness_N_per_mm is not None:
        middle, span = estimate(found.stiffness_N_per_mm)
        unit = found.units.stiffness_unit
        over = "" if found.which.verdict == "none" else ", causes weighed as told"
        said.append(
            f"The {found.units.stiffness}{over}: {middle} {unit}, 95 % credible "
            f"interval {span} {unit}, per {found.units.per} as read."
        )
    return said


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
    proof = [NO_PROOF] if _closes(found) else []
    worth = list(_certified(which))
    proportional = found.units.say(PROPORTIONAL)
    return [*_correlated(found), *_blind(which), *worth, proportional, *proof]


def _certified(which: Which) -> Iterator[str]:
    """Say how often such an answer was wrong where the truth was known."""
    counted = which.certificate
    if counted is None:
        return
    what = "names" if which.verdict == "named" else "groups"
    # Rounded up: it is a bound.
    most = math.ceil(1000.0 * counted.at_most) / 10.0
    yield (
        f"Of {counted.said} {what} given in a blind check, no effect withheld, "
        f"{counted.wrong} were wrong: at most {most:g} %, with a confidence of 95 %, "
        "for the causes of its catalogue on rigs like its own."
    )
    if which.verdict == "named" and known(which.lookalike_rate) and which.effect:
        yield (
            f"What is in no library may look like {label(which.effect)}: in blind "
            f"checks with effects withheld {lookalikes_counted(which)} cases that it "
            "alone described had another cause."
        )


def _correlated(found: VerdictAnswer) -> Iterator[str]:
    """Say how little readings tell whose neighbours err very much alike."""
    if known(rho := found.gap.autocorrelation) and rho >= _ALIKE:
        yield (
            f"Neighbouring readings err alike, with a correlation of {rho:.2f}: these "
            f"{found.data.rows_diagnosed} tell about as much as {_worth(found):.0f} "
            "independent ones."
        )


def _worth(found: VerdictAnswer) -> float:
    """Return as how many independent readings these tell, taken for one run."""
    rho = found.gap.autocorrelation
    return worth(found.data.rows_diagnosed, max(rho, 0.0) if known(rho) else 0.0)


def _blind(which: Which) -> Iterator[str]:
    if which.not_testable:
        lacking = "; ".join(map(with_needs, which.not_testable))
        yield f"Not testable with this data: {lacking}."
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
    more = f", nor {rest} other {pairs_word}" if rest else ""
    return f"This program can never tell {', '.join(texts)}{more}."


def _closes(found: VerdictAnswer) -> bool:
    return found.shrink.closed is not None


def _none(found: VerdictAnswer) -> Iterator[str]:
    gap, chance = found.gap, found.which.probabilities.get("none")
    noise = f"the noise of {one_reading(found)} is {load(gap.noise_sd_N, found.units)}"
    if gap.detected:
        yield (
            "Something departs slightly from pure noise (p = "
            f"{p_words(found.where.p_value)}), but that the model lacks nothing "
            f"remains the most probable ({percent(chance)}); {noise}."
        )
    else:
        rows = found.data.rows
        if found.seen:
            yield what_is_seen(found)
        no_gap = "Beside that no gap" if found.seen else "No gap"
        yield f"{no_gap} is seen: the model fits all {rows} readings; {noise}."
    if known(gap.noise_sd_N):
        yield f"Too small to be seen here: {_unseen(found)}."


def _unseen(found: VerdictAnswer) -> str:
    """Say how small a gap could go unseen, on average and in a range of deformation."""
    units = found.units
    mean = load(_DETECTABLE * found.gap.noise_sd_N / _worth(found) ** 0.5, units)
    widths = [
        cell.bias_N.hi - cell.bias_N.median
        for cell in found.where.cells
        if cell.covariate == "deformation" and known(cell.bias_N.hi)
    ]
    small = f"a gap of less than about {mean} on average"
    if not widths:
        return small
    low, high = load(min(widths), units), load(max(widths), units)
    bare = low.removesuffix(f" {units.load_unit}")
    span = low if low == high else f"{bare} … {high}"
    return f"{small}, or of less than {span} in one range of {units.displacement}"
