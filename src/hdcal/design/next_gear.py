"""The next gear: how it may differ from the tested one, drawn beside each draw."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from hdcal.data.records import Geometry
from hdcal.design.checks import name_findings
from hdcal.design.design_draws import Basis
from hdcal.design.sizes import SIZES, stiffness_factor
from hdcal.errors import Finding, InputError


@dataclass(frozen=True)
class NextGear:
    """One gear for each draw, none of them tested.

    Attributes:
        deviation: of its stiffness from the tested mean, relative, shape (draw,).
        shifts: of its sizes from the drawing [mm] by edge name, shape (draw,).
        words: what the population is.
    """

    deviation: np.ndarray
    shifts: Mapping[str, np.ndarray]
    words: str

    def interval_kind(self, basis: Basis) -> str:
        """What an interval over these gears is called: one with scatter predicts."""
        if not self.shifts and not np.any(self.deviation):
            return basis.interval_kind
        known = {"posterior": "predictive", "prior": "prior predictive"}[basis.kind]
        return f"equal-tailed {known} interval"

    def factor(self, basis: Basis, geometry: Geometry):
        """Return stiffness over the tested gear's of each gear, shape (draw,)."""
        moved = {
            SIZES[name]: getattr(geometry, SIZES[name]) + shift
            for name, shift in self.shifts.items()
        }
        made = stiffness_factor(basis, replace(geometry, **moved))
        return made * (1.0 + self.deviation)


def next_gear(
    basis: Basis, tolerances: Mapping[str, float] | None = None, seed: int = 0
) -> NextGear:
    """Draw the gears that a design has to serve.

    Args:
        basis: draws of the tested gear.
        tolerances: ± of a size [mm] by edge name; sizes are uniform within it, which
            is what limits alone say (JCGM 100:2008, 4.3.7).
        seed: of the scatter.

    Raises:
        InputError: a size is unknown, or its tolerance is none.
    """
    tolerances = dict(tolerances or {})
    findings = name_findings(tolerances, SIZES, "--tolerance")
    for name, width in tolerances.items() if not findings else ():
        own = float(getattr(basis.gear.geometry, SIZES[name]))
        if not 0.0 < width < 0.5 * own:
            words = f"{name} = {width:g} is no tolerance of {own:g} mm"
            remedy = "Give the ± part in mm, such as 0.02"
            findings.append(Finding("--tolerance", words, remedy))
    if findings:
        raise InputError(findings)
    random = np.random.default_rng(seed)
    shifts = {
        name: random.uniform(-width, width, basis.size)
        for name, width in tolerances.items()
    }
    tested = basis.problem.specimens
    deviation = np.zeros(basis.size)
    if tested:
        # A new gear also carries the distance of the tested mean from the population's.
        spread = np.sqrt(1.0 + 1.0 / tested) * np.asarray(basis.values["specimen_sd"])
        deviation = spread * random.normal(size=basis.size)
    return NextGear(deviation, shifts, _words(basis, tested, tolerances))


def _words(basis: Basis, tested: int, tolerances: Mapping[str, float]) -> str:
    sizes = ", ".join(f"{name} ± {width:g}" for name, width in tolerances.items())
    if basis.kind == "prior":
        told = "a gear of which only priors are known"
    elif tested:
        told = f"the next gear, with the scatter seen between {tested} tested ones"
    else:
        told = (
            "the tested gear: one gear says nothing of how much others differ, so "
            "this is no statement about a population"
        )
        if tolerances:
            told = (
                "the next gear as far as its sizes go: beyond their tolerances, one "
                "tested gear says nothing of how much others differ"
            )
    return told + (f"; sizes within {sizes} mm" if sizes else "")
