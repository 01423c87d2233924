"""What headers of test machines and loggers mean, in several languages.

A guess: it is told before anything else, with how to correct it.
"""

import re
from typing import NamedTuple

from hdcal.data.units import COLUMN_UNITS, known_unit

# Words for each quantity, in lower case: English, German, French, Chinese. One is
# misspelt, as loggers spell it.
WORDS: dict[str, tuple[str, ...]] = {
    "deformation": (
        *(
            "deformation",
            "displacement",
            "displacment",
            "deflection",
            "travel",
            "defl",
            "lvdt",
        ),
        *("disp",),
        *("stroke", "extension", "crosshead", "weg", "standardweg", "traversenweg"),
        *("verformung", "verschiebung", "hub", "déformation", "déplacement"),
        *("course", "位移", "变形", "行程"),
    ),
    "force": (
        *("force", "load", "kraft", "standardkraft", "prüfkraft", "last", "charge"),
        *("effort", "力", "载荷", "负荷"),
    ),
    "temperature": ("temperature", "temp", "temperatur", "température", "温度"),
    "time": ("time", "zeit", "prüfzeit", "temps", "durée", "时间"),
    "angle": ("angle", "winkel", "drehwinkel", "角度"),
    "run": (
        *(
            "run",
            "mounting",
            "repeat",
            "lauf",
            "messung",
            "versuch",
            "einspannung",
            "aufspannung",
        ),
        *("wiederholung", "essai"),
    ),
    "specimen": (
        *("specimen", "gear", "serial", "seriennummer", "probe", "prüfling"),
        "éprouvette",
    ),
    "lot": ("lot", "batch", "los"),
    "operator": ("operator", "inspector", "bediener", "prüfer", "opérateur"),
    "rig": ("rig", "testrig", "bench", "testbench", "prüfstand", "banc", "试验台"),
    "date": ("date", "datum", "prüfdatum"),
}
# Labels that say more of a gear or a mounting, and that no answer has to have.
GROUPINGS = ("lot", "operator", "rig", "date")
# What says that a column is something else about the quantity.
_OTHERWISE = {
    *("setpoint", "set", "target", "command", "soll", "sollwert", "consigne"),
    *("rate", "speed", "error", "max", "maximum", "min", "minimum", "peak", "mean"),
    *("sd", "std", "deviation", "offset", "tare", "limit", "grenze"),
    *("diameter", "durchmesser", "diamètre", "corrected", "korrigiert", "corrigé"),
}
# What stands for a quantity in formulas.
_LETTERS = {"F": "force", "T": "temperature", "t": "time"}
# What says no more than that a column holds labels.
_LABELS = {"no", "nr", "number", "nummer", "id", "numéro"}
_BRACKETS = re.compile(r"(?P<name>.*?)\s*[(\[]\s*(?P<unit>[^()\[\]]*?)\s*[)\]]\s*")
_BEHIND = re.compile(r"(?P<name>.*?\S)(?:\s*[/,]\s*|\s+in\s+|[\s_]+)(?P<unit>\S+)\s*")
_LONGEST = 80
_WIDE = re.compile("[\u4e00-\u9fff]")


class Guess(NamedTuple):
    """What a header is taken for.

    Attributes:
        quantity: that its column holds.
        unit: known to `COLUMN_UNITS`; empty where none is named, and for labels.
        whole: the header names the quantity and nothing else.
    """

    quantity: str
    unit: str
    whole: bool


def guess_header(header: str) -> Guess | None:
    """Return what a header means; None where that is not clear."""
    if len(header) > _LONGEST:
        return None
    for pattern in (_BRACKETS, _BEHIND):
        match = pattern.fullmatch(header)
        if match is None:
            continue
        # A letter means a quantity where a unit of it is beside it.
        letter = _LETTERS.get(match["name"], "")
        found = _quantity(match["name"]) or (
            Guess(letter, "", True) if letter else None
        )
        if found is None:
            continue
        unit = known_unit(found.quantity, match["unit"])
        if unit:
            return found._replace(unit=unit)
        if pattern is _BRACKETS and match["unit"]:
            # Newtons per second are no force.
            return None
    found = _quantity(header)
    return found if found is not None and found.whole else None


def _quantity(name: str) -> Guess | None:
    """Return the one quantity that a name speaks of."""
    words = re.findall(r"[^\W\d_]+", name.lower())
    if _OTHERWISE & {*words}:
        return None
    found = [
        quantity
        for quantity, known in WORDS.items()
        if any(word in words or (_WIDE.match(word) and word in name) for word in known)
    ]
    # Who stood beside a gauge does not name what it reads.
    found = [name for name in found if name not in GROUPINGS] or found
    if len(found) != 1:
        return None
    (quantity,) = found
    of_labels = set() if quantity in COLUMN_UNITS else _LABELS
    return Guess(quantity, "", len([w for w in words if w not in of_labels]) == 1)
