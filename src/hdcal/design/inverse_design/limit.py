"""The request for sizes that keep a limit of the force, and its checks."""

from collections.abc import Sequence

import numpy as np

from hdcal.data.plausible import implausible
from hdcal.design.checks import (
    name_findings,
    no_deformation,
    place_findings,
    probability_findings,
    size_findings,
    unused_findings,
)
from hdcal.design.design_draws import DesignDraws
from hdcal.design.design_result import Ends, Numbers
from hdcal.errors import Finding
from hdcal.prediction.engine.conditions import slip_findings
from hdcal.prediction.engine.loading_sense import (
    LoadingSense,
    capacity_findings,
    sense_of,
)
from hdcal.prediction.engine.sizes import SIZES
from hdcal.report.item import Item


class LimitAsked(Item):
    """The request for an inverse design.

    Attributes:
        deformation_mm: radial, of the gear.
        temperature_C: at all of which the limits have to be kept.
        limit_force_N: size of the force that must not be exceeded.
        limit_stress_MPa: hoop bending; None for the yield strength, if one is known.
        probability: with which each limit has to be kept.
        bounds: of each free size [mm] by name.
        tolerances_mm: ± of sizes by name.
    """

    deformation_mm: float
    temperature_C: Numbers
    limit_force_N: float
    limit_stress_MPa: float | None
    probability: float
    bounds: dict[str, Ends]
    tolerances_mm: dict[str, float]

    @property
    def sense(self) -> LoadingSense:
        """Sense of loading: forces have its sign, limits are along it."""
        return sense_of(self.deformation_mm)


def limit_findings(
    draws: DesignDraws, asked: LimitAsked, materials: Sequence[str], limit_force: float
) -> list[Finding]:
    """Return what is wrong with a request.

    Args:
        draws: of the tested gear.
        asked: the request.
        materials: to choose among.
        limit_force: as given, with or without its sign [N].
    """
    vary, place = asked.bounds, f"{asked.deformation_mm:g} mm"
    findings = name_findings(vary, SIZES, "vary")
    findings += capacity_findings("limit_force", limit_force, asked.sense, place)
    if not vary and not materials:
        words = "nothing may change"
        remedy = "Free a size, e.g. wall_thickness_mm=0.5:0.8"
        findings.append(Finding("vary", words, remedy))
    for name, value, unit in (
        ("limit_force", asked.limit_force_N, "N"),
        ("limit_stress", asked.limit_stress_MPa, "MPa"),
    ):
        wrong = implausible(name, value)
        if value == 0.0 and not wrong:
            wrong = [Finding(name, "0 is no limit", f"Give it in {unit}")]
        elif name == "limit_force" and not wrong:
            at = asked.deformation_mm
            wrong = slip_findings(name, limit_force, draws.usual_force(at), at)
        findings += wrong
    findings += probability_findings(draws, asked.probability)
    if any(name not in SIZES for name in vary):
        return findings
    for name, (low, high) in vary.items():
        if not low < high:
            words = f"{name} = {low:g}:{high:g} is empty"
            findings.append(Finding("vary", words, "Write NAME=LO:HI"))
    findings += unused_findings(draws, vary)
    sizes = {name: np.asarray(ends, float) for name, ends in vary.items()}
    findings += size_findings(draws, sizes)
    if np.isnan(asked.deformation_mm):
        return [*findings, no_deformation()]
    radius = float(np.min(sizes.get("radius_mm", draws.gear.geometry.radius)))
    place = np.array([asked.deformation_mm]), np.asarray(asked.temperature_C)
    return findings + place_findings(draws, *place, radius)
