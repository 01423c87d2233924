"""What the readings of a diagnosis show, in sentences."""

from hdcal.diagnosis.answer import VerdictAnswer
from hdcal.diagnosis.places import places
from hdcal.report.words import capital, known, load, or_zero

# Things seen that the answer tells; the report has all.
_MOST_SEEN = 3
# Statistics of the test that look at the scatter alone.
_SCATTER = ("p_spread", "p_tails")


def what_is_seen(found: VerdictAnswer) -> str:
    """Say what the readings show, else where they part from the model."""
    told = [
        each.statement + ("" if each.material else " (too small to matter)")
        for each in found.seen[:_MOST_SEEN]
    ]
    if not told or known(found.gap.rounding_N):
        return _where(found)
    return capital("; ".join(told)) + "."


def _where(found: VerdictAnswer) -> str:
    step, found_places = found.gap.rounding_N, list(places(found.where, found.units))
    if known(step):
        steps = load(step, found.units)
        return (
            f"The readings are rounded to steps of {steps}; nothing else sets them "
            "apart from the model."
        )
    if not found_places:
        return _nowhere(found)
    first, *rest = (
        f"{load(abs(bias), found.units)} {'higher' if bias > 0.0 else 'lower'}"
        + ("" if index else " than the calibrated model")
        + f" {words}"
        for index, (words, bias) in enumerate(found_places)
    )
    more = "".join(f", and {text}" for text in rest)
    return f"The measured {found.units.load} is up to {first}{more}."


def _nowhere(found: VerdictAnswer) -> str:
    """Say that no single range is off."""
    where = found.where
    p = p_words(where.p_value)
    chances = {n: v for n, v in where.statistics.items() if n.startswith("p_")}
    if min(chances, key=lambda n: or_zero(chances[n]), default="") in _SCATTER:
        return (
            f"The readings depart from the model (p = {p}), but no range of them is "
            "off on average: the departure is in their scatter."
        )
    size = load(found.gap.rms_N.median, found.units)
    return (
        f"The readings depart from the model by {size} rms (p = {p}), but no "
        "single range of them by enough to point at it."
    )


def p_words(value: float | None) -> str:
    """Return a p-value in words."""
    if not known(value):
        return "–"
    return "below 0.001" if value < 0.001 else f"{value:.2g}"
