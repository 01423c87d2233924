"""Names and units of load, displacement and stiffness of linear and torsional tests.

Internally a torque is a force and an angle a deformation; texts take names and units
from the `Quantities` of the case.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

# Placeholders of texts.
_PLACEHOLDERS = {
    "{load}": "load",
    "{displacement}": "displacement",
    "{N}": "load_unit",
    "{mm}": "displacement_unit",
    "{N/mm}": "stiffness_unit",
}
_WORD = re.compile(r"[A-Za-z]+")


@dataclass(frozen=True)
class Quantities:
    """Names and units of what was measured.

    Attributes:
        per: unit of the displacement in words.
        finer: another unit of the stiffness, with its size in `stiffness_unit`.
        parts: replacements of parts of names and units for force and deformation.
    """

    load: Literal["force", "torque"]
    displacement: str
    stiffness: str
    load_unit: str
    displacement_unit: str
    stiffness_unit: str
    per: str
    finer: tuple[str, float] | None = None
    parts: Mapping[str, str] = field(default_factory=dict, hash=False)

    def unit(self, code: str) -> str:
        """Return a unit written in N and mm, such as N*s/mm, in these units."""
        return _WORD.sub(lambda part: self._units.get(part[0], part[0]), code)

    def key(self, name: str) -> str:
        """Return a field or column such as stiffness_N_per_mm in these units."""
        parts = name.split("_")
        if not {"N", "mm"} & {*parts}:
            return name
        return "_".join(self.parts.get(part, part) for part in parts)

    def name(self, code: str) -> str:
        """Return the name of covariates such as deformation × direction."""
        return " ".join(self.parts.get(word, word) for word in code.split())

    def say(self, text: str) -> str:
        """Return a text with its placeholders, such as {load} and {N}, filled in."""
        for placeholder, name in _PLACEHOLDERS.items():
            text = text.replace(placeholder, getattr(self, name))
        return text

    def header(self, name: str) -> str:
        """Return the header of a column of readings such as force_N."""
        return self.key(name).replace("_N_m", "_Nm")

    @property
    def is_force(self) -> bool:
        """Whether forces and deformations were measured."""
        return self.load == "force"

    @property
    def _units(self) -> dict[str, str]:
        return {"N": self.load_unit, "mm": self.displacement_unit}


FORCE = Quantities("force", "deformation", "stiffness", "N", "mm", "N/mm", "millimetre")
TORQUE = Quantities(
    "torque",
    "angle",
    "torsional stiffness",
    "N·m",
    "rad",
    "N·m/rad",
    "radian",
    finer=("N·m/arcmin", 10800.0 / math.pi),
    parts={"force": "torque", "deformation": "angle", "N": "N_m", "mm": "rad"},
)
BY_LOAD = {each.load: each for each in (FORCE, TORQUE)}
