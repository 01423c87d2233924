"""The findings of a screening in sentences."""

from dataclasses import replace

import numpy as np

from hdcal.quantities import Quantities
from hdcal.screening.result import Kind, Observation

_LISTED = 4  # stretches of rows that one sentence names
_ZERO = "later rows are shifted back by it and form a run with its own zero"
_CUT = "{count} left out ({rows}): "
_SENTENCES: dict[Kind, str] = {
    "before the tare": "{count} at the beginning left out ({rows}): read before the "
    "tare, {size} {unit} from the readings after it",
    "jump of the force": "the zero of the {load} jumps by {signed} {unit} at {rows}: "
    + _ZERO,
    "jump of the deformation": "the zero of the {displacement} jumps by {signed} "
    "{unit} at {rows}: " + _ZERO,
    "jump of both": "{load} and {displacement} jump at {rows}, the {load} by {signed} "
    "{unit}: " + _ZERO,
    "wild reading": _CUT + "outliers, up to {size} {unit} from the curve through the "
    "neighbouring rows",
    "opposite sign": "the {load} falls as the {displacement} grows, by {size} {N/mm}, "
    "on every branch: one of the two has the opposite sign. The sign of the {load} "
    "is reversed",
    "negative slope": "the {load} falls as the {displacement} grows, by {size} {N/mm} "
    "on average, but not everywhere: a stiffness cannot be determined",
    "saturation of the force": _CUT + "the {load} stays at its limit of {signed} "
    "{unit} while the {displacement} changes",
    "saturation of the deformation": _CUT + "the {displacement} stays at its limit of "
    "{signed} {unit} while the {load} changes",
    "scatter of the deformation": "the reading of the {displacement} scatters by "
    "{size} {unit} (sd), which the {load} does not follow: each row is shifted along "
    "the "
    "line to the smoothed {displacement}",
    "after the largest force": _CUT + "the {load} drops permanently by {size} "
    "{unit} while the {displacement} increases further",
    "repeated reading": "{count} left out: each reading is repeated in {size} rows, "
    "because "
    "the logger is faster than the gauges",
    "outside the range": "{count} left out: outside the working range of {range}",
}
_CHOOSE = (
    "Check which columns are {load} and {displacement}, and their signs; or choose a "
    "part "
    "of the curve by `range`"
)
HIDDEN = (
    "the scatter of the {displacement} hides the direction of its movement: loading "
    "and unloading cannot be distinguished"
)


def in_words(
    found: Observation, labels: np.ndarray, working_range: str, units: Quantities
) -> Observation:
    """Return a finding with its rows and its sentence; labels are names of all rows."""
    words = _sentence(found, labels, units).replace("{range}", working_range)
    where, unit = _rows(found, labels), units.unit(found.unit)
    return replace(found, where=where, words=words, unit=unit)


def question(
    found: Observation, labels: np.ndarray, units: Quantities
) -> tuple[str, str]:
    """Return problem and remedy of a finding that the user has to decide about."""
    return _sentence(found, labels, units), units.say(_CHOOSE)


def _sentence(found: Observation, labels: np.ndarray, units: Quantities) -> str:
    text = units.say(_SENTENCES[found.kind])
    facts = {
        "{count}": f"{found.count} row{'s' if found.count > 1 else ''}",
        "{rows}": _rows(found, labels),
        "{size}": f"{abs(found.size):.4g}",
        "{signed}": f"{found.size:.4g}",
        "{unit}": units.unit(found.unit),
    }
    for placeholder, fact in facts.items():
        text = text.replace(placeholder, fact)
    return text


def _rows(found: Observation, labels: np.ndarray) -> str:
    each = [
        f"{labels[first]}" if first == last else _span(*labels[[first, last]])
        for first, last in found.rows[:_LISTED]
    ]
    more = ", …" if len(found.rows) > _LISTED else ""
    return f"row{'s' if found.count > 1 else ''} {', '.join(each)}{more}"


def _span(first: object, last: object) -> str:
    """Return a span of rows; of rows of one file, as '9 of a', the file once."""
    file = str(last).partition(" ")[2]
    return f"{str(first).removesuffix(f' {file}')}-{last}"
