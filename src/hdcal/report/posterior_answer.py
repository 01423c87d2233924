"""The gear of a calibration in an answer."""

from dataclasses import dataclass

from hdcal.data.theory_names import Theory


@dataclass(frozen=True)
class CalibratedGear:
    """The gear and the theory of its model."""

    name: str
    material: str
    theory: Theory
