"""Forces, probabilities and reliability indices of a margin as people write them."""

import math

# Rarer than this nobody can say; the words then say so.
RAREST = 1e-12
# A share from here on is as good as all.
NEARLY_ALL = 0.999


def chance(probability: float) -> str:
    """Return a probability; never one that nobody can know."""
    if probability < RAREST:
        return f"less than {RAREST:.0e}"
    if probability > NEARLY_ALL:
        return "more than 99.9 %"
    if probability > 0.9:
        return f"{100.0 * probability:.1f} %"
    if probability >= 0.001:
        return f"{100.0 * probability:.2g} %"
    return f"{probability:.1e}"


def index(beta: float) -> str:
    """Return a reliability index; beyond ± 7 no probability can be known."""
    if beta > 7.0:
        return "above 7"
    return "below −7" if beta < -7.0 else f"{beta:.2f}"


def newtons(value: float) -> str:
    """Return a force to four digits, with {N}, for `Quantities.say`."""
    text = f"{value:.1f}" if 10.0 <= abs(value) < 1e4 else f"{value:.4g}"
    return f"{text} {{N}}"


def newtons_down(value: float) -> str:
    """Return a force to the same digits, never more than it."""
    if value == 0.0:
        return newtons(value)
    last = 0.1
    if not 10.0 <= abs(value) < 1e4:
        last = 10.0 ** (math.floor(math.log10(abs(value))) - 3.0)
    return newtons(last * math.floor(value / last + 1e-9))
