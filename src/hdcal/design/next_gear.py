"""The next gear, which may differ from the tested one: one for each draw."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hdcal.data.plausible import implausible
from hdcal.design.checks import name_findings
from hdcal.design.design_draws import DesignDraws
from hdcal.errors import Finding, InputError
from hdcal.prediction.engine.population import new_member_sd
from hdcal.prediction.engine.sampled_gears import SampledGears
from hdcal.prediction.engine.sizes import SIZES


@dataclass(frozen=True)
class NextGear:
    """The gears that a design has to fit, one for each draw of the tested one."""

    gears: SampledGears

    def interval_kind(self, draws: DesignDraws) -> str:
        """Return the kind of an interval over these gears: predictive with scatter."""
        if not self.gears.shifts and not np.any(self.gears.deviation):
            return draws.interval_kind
        known = {"posterior": "predictive", "prior": "prior predictive"}[draws.kind]
        return f"equal-tailed {known} interval"

    def forces(self, deformation: np.ndarray, temperatures: np.ndarray) -> np.ndarray:
        """Return forces [N] at the tested sizes: [deformation, temperature, draw].

        Args:
            deformation: radial [mm].
            temperatures: [°C].
        """
        shape = len(deformation), len(temperatures), -1
        at = np.repeat(deformation, shape[1])
        warm = np.tile(temperatures, shape[0])
        return np.asarray(self.gears.forces(self.gears.tested, at, warm)).reshape(shape)


def next_gear(
    draws: DesignDraws,
    tolerances: Mapping[str, float] | None = None,
    seed: int = 0,
    smallest: Mapping[str, float] | None = None,
) -> NextGear:
    """Draw the gears that a design has to fit.

    Args:
        draws: of the tested gear.
        tolerances: ± of a size [mm] by edge name; sizes are uniform within it, which
            is the distribution of a size with known limits (JCGM 100:2008, 4.3.7).
        seed: of the scatter.
        smallest: least value of a size [mm], where it is less than the tested one.

    Raises:
        InputError: a size or its tolerance is not valid.
    """
    tolerances = dict(tolerances or {})
    findings = name_findings(tolerances, SIZES, "tolerances")
    for name, width in tolerances.items() if not findings else ():
        own = draws.size_of(name)
        own = min(own, (smallest or {}).get(name, own))
        if wrong := implausible("tolerances", width):
            findings += wrong
        elif not 0.0 < width < 0.5 * own:
            words = f"{name} = {width:g} is no tolerance of {own:g} mm"
            remedy = "Give the ± part in mm, such as 0.02"
            findings.append(Finding("tolerances", words, remedy))
    if findings:
        raise InputError(findings)
    random = np.random.default_rng(seed)
    shifts = {
        SIZES[name]: random.uniform(-width, width, draws.size)
        for name, width in tolerances.items()
    }
    tested, deviation = draws.problem.specimens, np.zeros(draws.size)
    if tested:
        spread = new_member_sd(np.asarray(draws.values["specimen_sd"]), tested)
        deviation = spread * random.normal(size=draws.size)
    gears = SampledGears(
        problem=draws.problem,
        values=dict(draws.values),
        tested=draws.gear.geometry,
        deviation=deviation,
        shifts=shifts,
        untested=draws.untested,
        theory=draws.theory,
    )
    return NextGear(gears)
