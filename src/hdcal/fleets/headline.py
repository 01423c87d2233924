"""What is said of a fleet first: how much gears scatter, and which are off in what."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from hdcal.fleets.answer import PopulationAnswer
from hdcal.fleets.notes import FEW
from hdcal.report.words import estimate, number, percent

_MOST_NAMED = 3
# Stiffness of a gear over that of most that counts as none.
_NO_RATIO = 1e-6


def headline(
    population: PopulationAnswer,
    called: Sequence[str],
    columns: Mapping[str, np.ndarray],
) -> str:
    """Return how many gears are alike, and which ones are off, in one sentence.

    Args:
        population: of the gears.
        called: off, the surest first.
        columns: of gears.csv.
    """
    total = len(columns["gear"])
    than = "" if population.lot_sd_percent is None else " than its lot"
    middle, span = estimate(population.gear_sd_percent)
    centre = estimate(population.stiffness_N_per_mm)[0]
    if not called:
        told = (
            f"None of {total} gears is called off: they scatter by {middle} % (sd, "
            f"{span} %) about {centre} {{N/mm}}"
        )
        far = columns["gear"][int(np.argmax(columns["probability_off"]))]
        odd = next(_off([str(far)], columns, than))
        odd = odd.replace("; prob", "; off with prob")
        return told + f"; oddest: {odd}." if total < FEW else f"{told}."
    told = "; ".join(_off(called, columns, than))
    alike = sum("stiffness" not in kinds for kinds in columns["off_in"])
    return f"{alike} of {total} gears scatter by {middle} % (sd, {span} %); {told}."


def _off(
    called: Sequence[str], columns: Mapping[str, np.ndarray], than: str
) -> Iterator[str]:
    """Yield what is said of the gears that are called off, the surest first.

    Args:
        called: their names.
        columns: of gears.csv.
        than: what they are softer than, where lots are told apart.
    """
    place = {name: row for row, name in enumerate(columns["gear"].tolist())}
    sizes = "own_noise_sd_N", "loop_N", "bend_N"
    told = {name: columns[name][np.isfinite(columns[name])] for name in sizes}
    usual = {name: float(np.median(v)) for name, v in told.items() if len(v)}
    for name in called[:_MOST_NAMED]:
        one = {column: values[place[name]] for column, values in columns.items()}
        yield f"{name} {' and '.join(_apart(one, usual, than))}"
    if rest := called[_MOST_NAMED:]:
        kinds = {str(columns["off_in"][place[name]]) for name in rest}
        are = "is" if len(rest) == 1 else "are"
        yield f"{len(rest)} more {are} off, in {', '.join(sorted(kinds))}"


def _apart(
    one: Mapping[str, Any], usual: Mapping[str, float], than: str
) -> Iterator[str]:
    """Yield how far a gear is off in what it is off in; in stiffness where in none.

    Args:
        one: its row of gears.csv.
        usual: what most gears have of noise, loop and bend [N].
        than: what it is softer than, where lots are told apart.
    """
    kinds = str(one["off_in"]).split(", ")
    if "stiffness" in kinds or kinds == [""]:
        yield _softer(one, than)
    if "noise" in kinds:
        # By its own readings: the law of all, which pulls it in, is not its own.
        noise = float(one["own_noise_sd_N"])
        times = noise / usual["own_noise_sd_N"]
        yield f"has {times:.2g} times the noise of most ({noise:.2g} {{N}})"
    if "zero" in kinds:
        yield f"has its zero at {one['zero_N']:.2g} {{N}}"
    if "shape" in kinds:
        yield _shaped(one, usual)


def _shaped(one: Mapping[str, Any], usual: Mapping[str, float]) -> str:
    """Return the loop or the bend of a gear, whichever is farther from that of most."""
    told = [name for name in ("loop_N", "bend_N") if np.isfinite(one[name])]
    name = max(told, key=lambda name: abs(float(one[name]) - usual[name]))
    what = {"loop_N": "a loop", "bend_N": "a bend"}[name]
    size, most = float(one[name]), usual[name]
    # As many digits of the others' as of its own: theirs may be next to nothing.
    return f"has {what} of {size:.2g} {{N}} (others: {number(most, 10.0 * size)} {{N}})"


def far_apart(percent_apart):
    """Tell whether a gear is twice as stiff as most or more, or half as stiff or less.

    Args:
        percent_apart: from the centre [%].
    """
    ratio = _ratio(percent_apart)
    return np.maximum(ratio, 1.0 / ratio) >= 2.0


def _ratio(percent_apart):
    return np.maximum(1.0 + percent_apart / 100.0, _NO_RATIO)


def _softer(one: Mapping[str, Any], than: str) -> str:
    apart, low, high = (float(one[f"apart_{end}"]) for end in ("percent", "lo", "hi"))
    word = "softer" if apart < 0.0 else "stiffer"
    if far_apart(apart):
        ratio = _ratio(apart)
        times = number(max(ratio, 1.0 / ratio))
        return f"is {times} times {word}{than}, as with another unit"
    size = (-apart, -high, -low) if apart < 0.0 else (apart, low, high)
    # Two digits of the interval's width.
    middle, least, most = (number(end, 10.0 * (high - low)) for end in size)
    sure = f"95 %: {least} … {most} %; probability {percent(one['probability_off'])}"
    return f"is {middle} % {word}{than} ({sure})"
