"""The findings of a screening in sentences."""

from dataclasses import replace

import numpy as np

from hdcal.quantities import Quantities
from hdcal.screening.result import Observation

# Stretches of rows that one sentence names.
_LISTED = 4
_REMEDIES = {
    "negative slope": (
        "the {force} falls as the {deformation} grows, by {size} {slope} in the mean, "
        "but not all along: no stiffness can be told from it",
        "Check which columns are {force} and {deformation}, and their signs; or choose "
        "the part that is meant by `range`",
    ),
}
_SENTENCES = {
    ("before the tare", "cut"): "{count} at the beginning left out ({rows}): read "
    "before the tare, {size} {unit} from where the record goes on",
    ("jump of the force", "new zero"): "the zero of the {force} jumps by {size} "
    "{unit} at {rows}: the rows from there on are moved back by it, as a run with its "
    "own zero",
    ("jump of the deformation", "new zero"): "the zero of the {deformation} jumps by "
    "{size} {unit} at {rows}: the rows from there on are moved back by it, as a run "
    "with its own zero",
    ("jump of both", "new zero"): "{force} and {deformation} jump at {rows}, the "
    "{force} by {size} {unit}: the rows from there on are moved back, as a run with "
    "its own zero",
    ("wild reading", "cut"): "{count} left out ({rows}): wild readings, up to {size} "
    "{unit} from the curve of their neighbours",
    ("opposite sign", "turned"): "the {force} falls as the {deformation} grows, by "
    "{size} {slope}, on every branch: one of the two is counted with the opposite "
    "sign. The sign of the {force} is turned",
    ("saturation of the force", "cut"): "{count} left out ({rows}): the {force} "
    "stands at its limit of {size} {unit} while the {deformation} goes on",
    ("saturation of the deformation", "cut"): "{count} left out ({rows}): the "
    "{deformation} stands at its limit of {size} {unit} while the {force} goes on",
    ("scatter of the deformation", "smoothed"): "the reading of the "
    "{deformation} scatters by {size} {unit} (sd), which the {force} does not follow: "
    "each row is moved along the line to the {deformation} smoothed over the rows",
    ("after the largest force", "cut"): "{count} left out ({rows}): the {force} "
    "has dropped by {size} {unit} for good while the {deformation} goes on",
    ("repeated reading", "cut"): "{count} left out: each reading stands in {size} "
    "rows, as the logger is faster than the gauges",
    ("outside the range", "cut"): "{count} left out: outside the working range of "
    "{range}",
}
_HIDDEN_DIRECTION = (
    "the scatter of the {deformation} hides the direction of its movement: loading and "
    "unloading are not told apart"
)


def in_words(
    found: Observation, labels: np.ndarray, working_range: str, units: Quantities
) -> Observation:
    """Return a finding with its rows and its sentence.

    Args:
        found: that was decided about.
        labels: name of each row in its file.
        working_range: in words.
        units: of what was measured.
    """
    facts = _facts(found, labels, units) | {"range": working_range}
    words = _SENTENCES[found.kind, found.action].format(**facts)
    where, unit = rows_words(found, labels), units.unit(found.unit)
    return replace(found, where=where, words=words, unit=unit)


def question(
    found: Observation, labels: np.ndarray, units: Quantities
) -> tuple[str, str]:
    """Return problem and remedy of a finding that the user has to decide about.

    Args:
        found: whose action is `asked`.
        labels: name of each row in its file.
        units: of what was measured.
    """
    problem, remedy = _REMEDIES[found.kind]
    facts = _facts(found, labels, units)
    return problem.format(**facts), remedy.format(**facts)


def hidden_direction(units: Quantities) -> str:
    """Return that loading and unloading cannot be told apart."""
    return _HIDDEN_DIRECTION.format(**_names(units))


def _names(units: Quantities) -> dict[str, str]:
    return {
        "force": units.load,
        "deformation": units.displacement,
        "slope": units.stiffness_unit,
    }


def _facts(found: Observation, labels: np.ndarray, units: Quantities) -> dict[str, str]:
    count = f"{found.count} row{'s' if found.count > 1 else ''}"
    size = f"{abs(found.size) if found.kind in _UNSIGNED else found.size:.4g}"
    rows = rows_words(found, labels)
    facts = {"count": count, "rows": rows, "size": size}
    return facts | {"unit": units.unit(found.unit)} | _names(units)


_UNSIGNED = {"wild reading", "after the largest force", "before the tare"}
_UNSIGNED |= {"opposite sign", "negative slope"}


def rows_words(found: Observation, labels: np.ndarray) -> str:
    """Return the rows of a finding as their file names them.

    Args:
        found: the finding.
        labels: name of each row in its file.
    """
    each = [
        f"{labels[first]}" if first == last else f"{labels[first]}-{labels[last]}"
        for first, last in found.rows[:_LISTED]
    ]
    more = ", …" if len(found.rows) > _LISTED else ""
    return f"row{'s' if found.count > 1 else ''} {', '.join(each)}{more}"
