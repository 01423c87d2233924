"""How a fleet goes with the date, in words."""

from collections.abc import Iterator, Sequence

from hdcal.fleets.over_time import TimeAnswer
from hdcal.report.document import Picture, Section, Sentences, Text
from hdcal.report.words import estimate, percent

_OF = {
    "stiffness": "The stiffness of gears",
    "zero": "The zero of mountings",
    "noise": "The noise of readings",
}
_SURE = 0.95
_MOST_NAMED = 5


def time_words(answer: TimeAnswer) -> str:
    """Return in one sentence whether a quantity changes, how and when."""
    what, sure = _OF[answer.what], percent(answer.probability_changed)
    if not answer.changed:
        if answer.probability_changed > 0.5:
            needed = percent(_SURE)
            return (
                f"{what}: that it changes is not sure ({sure}; told from {needed} on)."
            )
        return f"{what}: no change is told (probability that there is one: {sure})."
    told = f"{what} changes with the date (probability {sure})"
    way = answer.ways[answer.likeliest] / answer.probability_changed
    doubt = "" if way >= _SURE else "; which way is not settled, likeliest"
    future = "Gears and {load}s to come are told as if it did not"
    if answer.likeliest == "steps":
        future += (
            f"; what holds since then is told with `--since {answer.steps[-1].before}`"
        )
    future = f". {future}" * (answer.what != "noise")
    return f"{told}{doubt}: {_way(answer)}{future}."


def _way(answer: TimeAnswer) -> str:
    unit = "%" if answer.unit == "percent" else "{N}"
    if answer.likeliest == "steps":
        return "; ".join(_steps(answer, unit))
    if answer.likeliest == "drift":
        middle, span = estimate(answer.drift)
        size = f"by {middle} {unit} (95 % interval {span} {unit})"
        return f"it drifts {size} from {answer.first} to {answer.last}"
    return f"it differs from day to day, by {answer.days_sd:.2g} {unit} (sd)"


def _steps(answer: TimeAnswer, unit: str) -> Iterator[str]:
    for step in answer.steps:
        middle, span = estimate(step.size)
        yield (
            f"a step of {middle} {unit} (95 % interval {span} {unit}) between "
            f"{step.after} and {step.before}"
        )


def time_section(answers: Sequence[TimeAnswer]) -> Section:
    """Return what a page says of the date."""
    shown = Picture(
        "time",
        "Control charts in the order of measurement",
        "Stiffness of gears, zeros of mountings and noise of gears in the order of "
        "their date, with limits at three standard deviations; then the cumulative "
        "sums of the stiffness, with limits at five. Stiffness is about the centre of "
        "the gear's lot, zeros are about that of the operator, where they are told; "
        "what gains of rigs differ by is taken out.",
    )
    out = [
        f"{one.what} of {name}"
        for one in answers
        for name in one.left_out[:_MOST_NAMED]
    ]
    left = f" Far from those before and after, and left out: {', '.join(out)}."
    most = max(answers, key=lambda one: one.dates)
    soft = (
        f"{most.dates} dates from {most.first} to {most.last}. What is asked is "
        "whether values stay, step, drift or differ from day to day; that they stay "
        "has the probability one half before the data. A rig that changes and gears "
        f"that change look alike.{left if out else ''}"
    )
    words = Sentences([time_words(one) for one in answers])
    return Section("Over time", [words, shown, Text(soft, soft=True)])
