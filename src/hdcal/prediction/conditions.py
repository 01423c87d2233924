"""Conditions and population of a force, and what the readings tested."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from hdcal.data.case import Case, Gear
from hdcal.data.plausible import implausible
from hdcal.data.records import Records
from hdcal.errors import Finding
from hdcal.inference.force_model.problem import Problem
from hdcal.inference.force_model.values import Values
from hdcal.prediction.forces import Quantity
from hdcal.prediction.joint import JointModel
from hdcal.quantities import Quantities

Direction = Literal["up", "down"]
DIRECTIONS: tuple[Direction, ...] = get_args(Direction)
SENSE = {"up": 1.0, "down": -1.0}
# Members whose forces differ.
Population = Literal["readings", "mountings", "specimens"]
POPULATIONS: tuple[Population, ...] = get_args(Population)
# How far beyond the data still counts as tested: thermometers are no better [K], and
# a deformation is compared with itself as it was written [mm].
NEAR_K, NEAR_MM = 1.0, 1e-9
# A deformation this many times the largest that was read is a wrong unit; so is a
# force this many times larger or smaller than the usual.
OFF = 100.0
# Where positions were read, one so many times as far from the unloaded part is rather a
# deformation.
_OFF_POSITION = 5.0
# Draws that must lie beyond a bound to locate it.
_BEYOND = 10
# A rarer case than one in a million rests on the normal law of the scatter alone:
# no test of this size has readings so far out.
RAREST = 1e-6
# A relative change of Young's modulus this large or larger is a wrong unit [-].
_MOST_LOSS = 0.5


@dataclass(frozen=True)
class Conditions:
    """Conditions of n forces, (n,) each.

    The deformation [mm] is as read, or true for a load; the loading is +1 in
    compression and -1 in tension; unloading is whether the deformation is reached from
    a larger one. Tolerances are ± of sizes by field of the geometry [mm], the factor is
    the stiffness relative to the tested gear's, scalar, (n,) or (draw, n).
    """

    deformation: np.ndarray
    temperature: np.ndarray
    loading: np.ndarray
    unloading: np.ndarray
    quantity: Quantity | Literal["gear"] = "reading"
    tolerances: Mapping[str, float] = field(default_factory=dict)
    factor: np.ndarray | float = 1.0

    @classmethod
    def of(
        cls,
        deformation: ArrayLike,
        temperature: ArrayLike,
        loading: ArrayLike = 1.0,
        unloading: ArrayLike = False,
        **more: Any,
    ) -> "Conditions":
        """Return conditions of numbers and arrays that broadcast to (n,)."""
        at, warm, sense, back = np.broadcast_arrays(
            np.atleast_1d(np.asarray(deformation, float)),
            np.asarray(temperature, float),
            np.asarray(loading, float),
            np.asarray(unloading, bool),
        )
        return cls(at, warm, sense, back, **more)

    @property
    def size(self) -> int:
        """Number of conditions."""
        return len(self.deformation)

    @property
    def movement(self) -> np.ndarray:
        """+1 where the deformation as read rises, -1 where it falls, (n,)."""
        return np.where(self.unloading, -self.loading, self.loading)

    def turn(self, records: Records) -> np.ndarray:
        """Return where unloading begins [mm]: as far as was tested, or here."""
        tested = np.where(
            self.loading > 0.0,
            np.max(records.deformation),
            np.min(records.deformation),
        )
        farthest = np.maximum(self.loading * tested, self.loading * self.deformation)
        return self.loading * farthest


def beyond_tested(deformation: float, records: Records) -> float:
    """Return how far a deformation lies outside the tested range, as a share of it."""
    low, high = float(np.min(records.deformation)), float(np.max(records.deformation))
    beyond = max(low - deformation, deformation - high, 0.0)
    return beyond / (high - low) if beyond > NEAR_MM else 0.0


def direction_of_loading(model: JointModel, deformation: float) -> Literal[1, -1]:
    """Return +1 where the gear is pressed in most draws, -1 where it is pulled."""
    pressed = np.mean(model.draws["deformation_offset"] <= deformation)
    return 1 if pressed >= 0.5 else -1


def widest(problem: Problem) -> Population:
    """Return the widest population of which the data hold two members or more."""
    if problem.specimens >= 2:
        return "specimens"
    return "mountings" if problem.runs >= 2 else "readings"


def population_findings(asked: str, problem: Problem) -> list[Finding]:
    """Return why the data cannot describe a population; empty where they can."""
    if asked not in POPULATIONS:
        words = f"'{asked}' is not a population"
        return [Finding("population", words, f"Use one of {', '.join(POPULATIONS)}")]
    counts = {"mountings": problem.runs, "specimens": problem.specimens}
    if counts.get(asked, 2) >= 2:
        return []
    words = f"the data contain only one of the {asked}, so their scatter is unknown"
    remedy = f"Measure two or more, or choose {widest(problem)}"
    return [Finding("population", words, remedy)]


def usual_temperature(case: Case) -> float:
    """Return the tested temperature nearest to the reference [°C]."""
    tested = case.records.temperature
    reference = case.gear.reference_temperature
    return float(np.clip(reference, np.min(tested), np.max(tested)))


def usual_sd(records: Records) -> float:
    """Return the stated sd of a new reading: as good as the tested on average [N]."""
    return float(np.sqrt(np.mean(records.force_sd**2)))


def is_tested(records: Records, *, deformation, temperature, sense) -> np.ndarray:
    """Return where the data hold a deformation [mm], a temperature [°C] and a sense."""
    return (
        _within(deformation, records.deformation, NEAR_MM)
        & temperature_is_tested(records, temperature)
        & np.isin(sense, np.asarray(records.sense))
    )


def temperature_is_tested(records: Records, temperature) -> np.ndarray:
    """Return which temperatures [°C] lie within those of the data."""
    return _within(temperature, records.temperature, NEAR_K)


def _within(values, measured, slack: float) -> np.ndarray:
    low, high = np.min(measured), np.max(measured)
    return (values >= low - slack) & (values <= high + slack)


def far_findings(
    gear: Gear, units: Quantities, deformation: float, tested: float, zero: float
) -> list[Finding]:
    """Return a finding where a deformation can only be in a wrong unit.

    `tested` is how far from `zero`, the unloaded gear, was read [mm].
    """
    size, unit = abs(deformation - zero), units.displacement_unit
    most = tested * (_OFF_POSITION if abs(zero) > tested else OFF)
    if size < gear.reach and size <= most:
        return []
    words = (
        f"{deformation:g} {unit} is far beyond the readings, up to {tested:g} {unit}"
    )
    words += f" from {zero:g} {unit}" if zero else ""
    return [Finding("deformation", words, f"Give the deformation in {unit}")]


def excluded_findings(case: Case, deformation: float, sense: float) -> list[Finding]:
    """Return a finding where rows were left out: at a deformation, or in a sense."""
    if case.excluded_sense and sense == case.excluded_sense:
        way = "increases" if sense > 0.0 else "decreases"
        words = "the calibration left out the readings where the "
        words += f"{case.units.displacement} {way}"
        remedy = "Choose the other direction, or calibrate with `range` all"
        return [Finding("direction", words, remedy)]
    if not any(low < deformation < high for low, high in case.excluded):
        return []
    tested, unit = np.asarray(case.records.deformation), case.units.displacement_unit
    words = (
        f"{deformation:g} {unit} is outside the calibrated part of the curve, "
        f"{tested.min():.4g} to {tested.max():.4g} {unit}; readings there were left out"
    )
    remedy = "Choose a deformation inside, or calibrate with `range` all"
    return [Finding("deformation", words, remedy)]


def temperature_findings(
    gear: Gear, values: Values, temperature: np.ndarray
) -> list[Finding]:
    """Return what is impossible about one or more temperatures [°C]."""
    if wrong := implausible("temperature", temperature):
        return wrong
    rise = np.max(np.abs(temperature - gear.reference_temperature))
    if np.median(values["alpha"]) * rise >= _MOST_LOSS:
        words = "Young's modulus would change by half or more at this temperature"
        return [Finding("temperature", words, "Give the temperature in °C")]
    return []


def share_findings(
    shares: Mapping[str, float], draws: int, more: str = ""
) -> list[Finding]:
    """Return findings for values that are no probabilities or cannot be resolved."""
    findings = [f for name, value in shares.items() for f in implausible(name, value)]
    if findings:
        return findings
    most = 1.0 - _BEYOND / draws
    for name, share in shares.items():
        if name == "confidence" and share > most:
            words = f"{draws} draws cannot resolve a confidence of {share:g}"
            findings.append(Finding(name, words, f"Give {most:.4g} or less{more}"))
        elif name != "confidence" and share > 1.0 - RAREST:
            words = (
                f"{share:.12g} is too high to be supported by the model of the scatter"
            )
            findings.append(Finding(name, words, f"Give {1.0 - RAREST:g} or less"))
    return findings
