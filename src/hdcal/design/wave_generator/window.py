"""The request for a wave generator, and its checks."""

import numpy as np

from hdcal.data.plausible import implausible
from hdcal.design.checks import place_findings, probability_findings
from hdcal.design.design_draws import DesignDraws
from hdcal.design.design_result import Ends, Numbers
from hdcal.errors import Finding
from hdcal.prediction.engine.loading_sense import LoadingSense, ends_along, sense_of
from hdcal.report.item import Item


class WindowAsked(Item):
    """The request for a wave generator.

    Attributes:
        window_mm: lo and hi of the deformation, of one sign.
        temperature_C: at all of which the window has to be kept.
        probability: with which it has to be kept.
        setting_sd_mm: scatter of the set point as built.
        tolerances_mm: ± of sizes by name.
    """

    window_mm: Ends
    temperature_C: Numbers
    probability: float
    setting_sd_mm: float
    tolerances_mm: dict[str, float]

    @property
    def sense(self) -> LoadingSense:
        """Sense of loading: forces and set points have its sign."""
        return sense_of(sum(self.window_mm))

    @property
    def sizes_mm(self) -> Ends:
        """Least deformation (less: backlash) and largest (more: jam) in size."""
        return ends_along(*self.window_mm, self.sense)

    @property
    def middle_mm(self) -> float:
        """Middle of the window."""
        return 0.5 * sum(self.window_mm)


def window_findings(
    draws: DesignDraws, asked: WindowAsked, rates: tuple[float, float] | None
) -> list[Finding]:
    """Return what is wrong with a request.

    Args:
        draws: of the tested gear.
        asked: the request.
        rates: spring rates to consider [N/mm], or None.
    """
    findings: list[Finding] = []
    low, high = asked.window_mm
    if not low < high:
        words = f"{low:g}:{high:g} is empty"
        findings.append(Finding("window", words, "Write LO:HI, e.g. 0.38:0.42"))
    elif low < 0.0 < high:
        words = f"{low:g}:{high:g} contains zero, where no spring presses or pulls"
        remedy = "Give both ends one sign, e.g. 0.38:0.42"
        findings.append(Finding("window", words, remedy))
    findings += probability_findings(draws, asked.probability)
    findings += implausible("setting_sd", asked.setting_sd_mm)
    findings += implausible("rates", rates)
    if rates is not None and not rates[0] < rates[1]:
        words = f"{rates[0]:g}:{rates[1]:g} is no range of spring rates"
        findings.append(Finding("rates", words, "Write LO:HI in N/mm"))
    radius = float(draws.gear.geometry.radius)
    place = np.asarray(asked.window_mm, float), np.asarray(asked.temperature_C)
    names = "window", "temperatures"
    return findings + place_findings(draws, *place, radius, names)
