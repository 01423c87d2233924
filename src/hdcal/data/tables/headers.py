"""Headers: which quantity a column holds, and in which unit, in several languages."""

import re
import unicodedata
from functools import cache
from typing import NamedTuple

from hdcal.data.units import SIZES, Unit, find_unit

# Dimension of each quantity that is a number.
DIMENSIONS = {
    "deformation": "length",
    "force": "force",
    "temperature": "temperature",
    "time": "time",
    "angle": "angle",
    "torque": "torque",
    "force_sd": "force",
}
# Labels that say more of a gear or a mounting, and that no answer has to have.
GROUPINGS = ("lot", "operator", "rig", "date")
LABELS = ("run", "specimen", *GROUPINGS)
QUANTITIES = (*DIMENSIONS, *LABELS)
# Words of headers in English, German, French, Italian, Chinese and Japanese, in lower
# case without accents. One is misspelt, as loggers spell it.
_ALIASES = {
    "deformation": """deformation displacement displacment deflection travel stroke
        extension compression crosshead traverse lvdt disp displ defl verformung
        verschiebung hub weg standardweg traversenweg federweg deplacement course fleche
        spostamento corsa 位移 变形 行程 変位 変形 伸び ストローク""",
    "force": """force load kraft last standardkraft prufkraft zugkraft druckkraft
        federkraft charge effort forza carico 力 载荷 负荷 荷重""",
    "torque": "torque moment drehmoment couple coppia 扭矩 转矩 トルク",
    "angle": """angle rotation twist winkel drehwinkel verdrehwinkel verdrehung torsion
        angolo 角度 转角 回転角""",
    "temperature": "temperature temp temperatur temperatura 温度",
    "time": "time zeit prufzeit laufzeit temps duree tempo 时间 時間",
    "run": """run mounting mount repeat lauf messung versuch einspannung aufspannung
        wiederholung essai""",
    "specimen": """specimen gear serial seriennummer probe prufling eprouvette provino
        campione 试样 試験片""",
    "lot": "lot batch los charge",
    "operator": "operator inspector bediener prufer operateur",
    "rig": "rig testrig bench testbench prufstand banc 试验台",
    "date": "date datum prufdatum 日期",
}
_LETTERS = {"F": "force", "T": "temperature", "t": "time", "M": "torque"}
# What says that a column is something else about the quantity.
_OTHERWISE = """
    setpoint set target command soll sollwert consigne rate speed error max maximum min
    minimum peak mean average sd std deviation offset tare limit grenze diameter
    durchmesser diametre thickness dicke epaisseur width breite largeur length lange
    longueur height hohe hauteur position separation ecartement abstand compensation
    radius pitch corrected korrigiert corrige
"""
# What says no more about a column.
_FILLERS = "no nr number nummer id numero ch channel in"
# A travel in degrees is an angle, a load in Nm a torque.
_TURNING = {("deformation", "angle"): "angle", ("force", "torque"): "torque"}
_OWN = re.compile(
    rf"({'|'.join(sorted(QUANTITIES, key=len, reverse=True))})(?:_([^()\[\]]*))?",
    re.IGNORECASE,
)
_BRACKETED = re.compile(r"(.*?)[\s_]*[(\[]\s*(?:in\s+)?([^()\[\]]*?)\s*[)\]]\s*")
_TRAILING = re.compile(r"(.*\S)(?:\s*[/,]\s*|\s+in\s+|[\s_]+)(\S+)\s*")
_WIDE = re.compile("[\u3040-\u30ff\u4e00-\u9fff]")
_LONGEST = 120
# Units of other things, which a row of units may hold.
_OTHER_UNITS = """% V mV A mA Hz kHz - -- 1 d bar Pa kPa MPa GPa psi g kg t lb lbs oz
    με με mm/mm mm² mm^2 mm2 J W ℃ Volt Volts dB"""
# Those of them that behind a header are more likely a part of its name.
_NAMES = "- -- 1 d t A J W"
_MASSES = {"g": "gf", "kg": "kgf"}
_EITHER = {"lb": "lbf", "lbs": "lbf", "oz": "ozf"}
_TORQUES = {"lbin": "lbf*in", "inlb": "lbf*in", "lbft": "lbf*ft", "ftlb": "lbf*ft"}
_ADVICE = {
    "a mass; the unit of its weight is": _MASSES | {"t": "1000 kgf"},
    "a mass or a force; the unit of force is": _EITHER,
    "a mass times a length; the unit of torque is": _TORQUES,
}


class Header(NamedTuple):
    """What a header means."""

    quantity: str  # empty where its words name none
    unit_text: str  # its unit as written; empty without one
    unit: Unit | None  # None where that is none of a quantity
    exact: bool  # it is spelt `quantity_unit`
    whole: bool  # it names the quantity and nothing else
    excluded: bool  # it names something else about a quantity, such as a rate

    def measures(self, quantity: str) -> bool:
        """Tell whether its unit is one of a quantity."""
        dimension = DIMENSIONS.get(quantity)
        return self.unit is not None and self.unit.dimension == dimension


@cache
def parse_header(text: str) -> Header:
    """Return what a header means."""
    bare = unicodedata.normalize("NFKC", text).strip() if len(text) < _LONGEST else ""
    exact = _OWN.fullmatch(bare)
    if exact is not None:
        quantity, unit_text = exact[1].lower(), exact[2] or ""
        spelt = unit_text and "_" not in unit_text and not _is_other(unit_text)
        if spelt or (quantity in LABELS and not unit_text):
            unit = find_unit(unit_text)
            return Header(quantity, unit_text, unit, True, True, False)
    name, unit_text = split_unit(bare)
    unit = find_unit(unit_text)
    words = _words(name)
    excluded = any(map(_is_other, words))
    quantity, named = ("", set()) if excluded else _quantity(name, words, unit)
    if quantity in LABELS and unit is not None:
        # A blank and a letter may be part of a label's name, brackets are not.
        quantity, unit = ("", unit) if bare.endswith((")", "]")) else (quantity, None)
    others = {*words} - {*_FILLERS.split()} - named
    # Without a unit a header has to name the quantity and nothing else.
    if others and unit is None and not _WIDE.search(name):
        quantity = ""
    return Header(quantity, unit_text, unit, False, not others, excluded)


def split_unit(text: str) -> tuple[str, str]:
    """Split headers such as 'Load [kN]', 'Load / kN' and 'load_kN' at their units."""
    if (parts := _BRACKETED.fullmatch(text)) is not None:
        return parts[1], parts[2]
    parts = _TRAILING.fullmatch(text)
    if parts is not None and parts[2] not in _NAMES.split() and is_unit_text(parts[2]):
        return parts[1], parts[2]
    return text, ""


def is_unit_text(text: str) -> bool:
    """Tell whether a cell holds a unit and nothing else, of whatever it is."""
    bare = unicodedata.normalize("NFC", text.strip().strip("()[]").strip())
    ratio = re.fullmatch(r"[^\W\d]{1,3}/[^\W\d]{1,3}[²^2]*", bare)
    return bool(find_unit(text) or bare in _OTHER_UNITS.split() or ratio)


def unit_advice(text: str, quantity: str) -> str:
    """Return what to write for a text that is no unit of a quantity."""
    names = [spellings.split()[0] for spellings in SIZES[DIMENSIONS[quantity]]]
    bare = re.sub(r"[\s·*.-]", "", text)
    near = [name for name in names if name.lower() == bare.lower()]
    for words, forces in _ADVICE.items():
        if bare in forces:
            return f"{text} is {words} {forces[bare]}"
    if bare in ("V", "mV", "Volt", "Volts"):
        return f"{text} is a raw signal: convert it with its calibration first"
    hint = f" (did you mean {near[0]}?)" if near else ""
    return f"UNIT is one of: {', '.join(names)}{hint}"


def weight_unit(text: str) -> str:
    """Return the unit of the weight of a mass in this unit; empty for any other."""
    return (_MASSES | _EITHER).get(text, "")


def _words(name: str) -> list[str]:
    """Return the words of a name in lower case, without accents."""
    parts = unicodedata.normalize("NFKD", name.casefold())
    plain = "".join(part for part in parts if not unicodedata.combining(part))
    return re.findall(r"[^\W\d_]+", plain)


def _is_other(word: str) -> bool:
    return word in _OTHERWISE.split() or word.startswith("soll")


def _quantity(name: str, words: list[str], unit: Unit | None) -> tuple[str, set[str]]:
    """Return the quantity that a name with a unit means, and the words for it."""
    letter = _LETTERS.get(name.strip(), "")
    if letter and unit is not None and unit.dimension == DIMENSIONS[letter]:
        return letter, {*words}
    wide = unicodedata.normalize("NFKC", name)
    named = {
        quantity: {
            alias
            for alias in aliases.split()
            if alias in words or (_WIDE.match(alias) and alias in wide)
        }
        for quantity, aliases in _ALIASES.items()
    }
    named = {quantity: hits for quantity, hits in named.items() if hits}
    if unit is not None:
        turned = {_TURNING.get((q, unit.dimension), q): named[q] for q in named}
        fits = {q: h for q, h in turned.items() if DIMENSIONS.get(q) == unit.dimension}
        named = fits or {q: h for q, h in turned.items() if q in DIMENSIONS} or turned
    # An operator in the name of a gauge is not what it reads.
    named = {q: hits for q, hits in named.items() if q not in GROUPINGS} or named
    if len(named) != 1:
        return "", set()
    ((quantity, hits),) = named.items()
    return quantity, {word for word in words if word in hits or _WIDE.match(word)}
