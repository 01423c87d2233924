"""Check of a case: what was read, what is assumed and which effects can be tested."""

from collections.abc import Mapping
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, InstanceOf, computed_field

from hdcal.calibration.check.charts import readings_chart
from hdcal.calibration.straight_line import takes_straight_part
from hdcal.data.case import Case
from hdcal.data.gear_file.certificates import ZEROS, certificate_priors, is_stated
from hdcal.data.gear_file.schema import certificates_in
from hdcal.data.loading import loading
from hdcal.data.records import Array
from hdcal.data.theory_names import SPRING, Theory
from hdcal.physics.registry import EFFECTS
from hdcal.physics.theory import THEORIES
from hdcal.report.charts.chart_spec import Chart
from hdcal.report.item import Count, Digest, EffectName, Item, Words
from hdcal.report.result import Result
from hdcal.report.words import UNITS
from hdcal.screening.result import HOLDING, LOADING, SEGMENT_WORDS, SEGMENTS, Screening

# Prior standard deviations of log K that contain 99.7 % of it.
_FAR = 3.0

Ends = tuple[float, float]


class CheckedGear(Item):
    """What the gear file states."""

    name: str
    material: str
    theory: Theory
    deformation: Literal["radial", "diametral"]
    reference_temperature_C: float
    force_resolution_N: float | None


class StatedError(Item):
    """A standard uncertainty that a certificate states, the prior of a parameter."""

    parameter: str
    standard_uncertainty: float
    unit: str
    certificate: str


class RowsByMovement(Item):
    """Number of rows by the movement before them; loading is away from no load."""

    loading: Count
    holding: Count
    unloading: Count


class CheckedData(Item):
    """What was measured, with the covariates and features that can be used."""

    rows: Annotated[int, Field(ge=1)]
    runs: tuple[str, ...]
    specimens: tuple[str, ...]
    deformation_mm: Ends
    force_N: Ends
    temperature_C: Ends
    temperature_measured: bool
    direction: RowsByMovement
    known: tuple[str, ...]
    sha256: Digest


class TestableEffects(Item):
    """Effects that the data can show, and what the data lack for the others."""

    testable: tuple[EffectName, ...]
    not_testable: dict[str, tuple[str, ...]]


class ScreenedFinding(Item, from_attributes=True):
    """A finding of the screening: what it is, where, how large, and what was done."""

    kind: str
    rows: str = Field(validation_alias="where")
    row_count: Count = Field(validation_alias="count")
    size: float
    unit: str
    action: str
    words: Words


class StraightRange(Item):
    """The longest straight part of the curve, and whether that is all of it."""

    deformation_mm: Ends
    stiffness_N_per_mm: float
    standard_error_N_per_mm: float
    whole: bool


class Screened(Item):
    """What the screening found, with the number of rows of each segment."""

    findings: tuple[ScreenedFinding, ...]
    segments: dict[str, Count]
    working_range: str
    straight_part: StraightRange | None


class CaseCheck(Result):
    """What was read of a case.

    `implausible_K` is the slope of the readings as K, with the ends of its prior, if it
    lies outside.
    """

    template = "calibration/check/report.md.j2"
    table = "findings"

    format: Literal["hdcal.check/1"] = "hdcal.check/1"
    name: str = Field(serialization_alias="case")
    gear: CheckedGear
    certificates: tuple[StatedError, ...]
    data: CheckedData
    effects: TestableEffects
    screening: Screened | None
    case: Annotated[InstanceOf[Case], Field(exclude=True)]
    implausible_K: tuple[float, float, float] | None = Field(exclude=True)

    @computed_field
    @property
    def notes(self) -> tuple[Words, ...]:
        """Doubts, assumptions and remarks."""
        return self.lines("notes")

    @property
    def findings(self) -> tuple[ScreenedFinding, ...]:
        """What the screening found."""
        return self.screening.findings if self.screening else ()

    @property
    def left_out(self) -> dict[str, int]:
        """Number of rows of each segment that was left out, by its words."""
        kept = SEGMENTS[LOADING : HOLDING + 1]
        found = self.screening.segments if self.screening else {}
        return {SEGMENT_WORDS.get(n, n): k for n, k in found.items() if n not in kept}

    @property
    def takes_part(self) -> bool:
        """Whether `calibrate` takes the longest straight part only."""
        return takes_straight_part(self.case)

    def make_charts(self) -> Mapping[str, Chart]:
        """Return the readings."""
        return {"readings": readings_chart(self.case)}


def check(case: Case) -> CaseCheck:
    """Return what was read of a case."""
    gear, records = case.gear, case.records
    lacking = {
        name: tuple(sorted(effect.needs - records.known))
        for name, effect in EFFECTS.items()
    }
    return CaseCheck(
        name=case.name,
        gear=CheckedGear(
            name=gear.name,
            material=gear.material,
            theory=gear.theory,
            deformation=gear.reading,
            reference_temperature_C=gear.reference_temperature,
            force_resolution_N=gear.force_resolution or None,
        ),
        certificates=_certificates(case),
        data=_data(case),
        effects=TestableEffects(
            testable=tuple(name for name, lack in lacking.items() if not lack),
            not_testable={name: lack for name, lack in lacking.items() if lack},
        ),
        screening=_screened(case.screening),
        case=case,
        implausible_K=_implausible_K(case),
        part="part" if gear.theory == SPRING else "gear",
        units=case.units,
    )


def _certificates(case: Case) -> tuple[StatedError, ...]:
    gear = case.gear
    priors = {name: gear.priors[name] for name in ZEROS} | gear.gauge_priors
    stated = certificate_priors(certificates_in(gear.source))
    return tuple(
        StatedError(
            parameter=name,
            standard_uncertainty=float(stated[name].numbers[1]) * UNITS[name][1],
            unit=UNITS[name][0],
            certificate=stated[name].source,
        )
        for name, prior in priors.items()
        if is_stated(prior)
    )


def _implausible_K(case: Case) -> tuple[float, float, float] | None:
    """Return K of a straight line through the readings, with the ends of its prior.

    None if K lies between them, or if its prior is not lognormal.
    """
    gear, records = case.gear, case.records
    prior, modulus = gear.priors["K"], gear.priors["E0"].numbers[0]
    if prior.family != "lognormal":
        return None
    radial = np.asarray(records.deformation) / (2 if gear.reading == "diametral" else 1)
    slope = np.polyfit(radial, np.asarray(records.force), 1)[0]
    K = float(slope / THEORIES[gear.K_theory](gear.geometry, modulus))
    median, log_sd = map(float, prior.numbers)
    low, high = median * np.exp([-_FAR * log_sd, _FAR * log_sd])
    return None if low <= K <= high else (K, low, high)


def _data(case: Case) -> CheckedData:
    records = case.records
    movement = loading(case.from_unloaded, np.asarray(records.direction))
    loaded, held, unloaded = (int(np.sum(movement == sign)) for sign in (1, 0, -1))
    return CheckedData(
        rows=len(records.force),
        runs=case.run_labels,
        specimens=case.specimen_labels,
        deformation_mm=_ends(records.deformation),
        force_N=_ends(records.force),
        temperature_C=_ends(records.temperature),
        temperature_measured="temperature" in records.known,
        direction=RowsByMovement(loading=loaded, holding=held, unloading=unloaded),
        known=tuple(sorted(records.known)),
        sha256=case.data_sha256,
    )


def _ends(values: Array) -> Ends:
    return float(np.min(values)), float(np.max(values))


def _screened(found: Screening | None) -> Screened | None:
    if found is None:
        return None
    part, rows = found.straight, np.bincount(found.segment, minlength=len(SEGMENTS))
    straight = part and StraightRange(
        deformation_mm=(part.low, part.high),
        stiffness_N_per_mm=part.slope,
        standard_error_N_per_mm=part.slope_sd,
        whole=part.whole,
    )
    return Screened(
        findings=tuple(map(ScreenedFinding.model_validate, found.observations)),
        segments={n: int(k) for n, k in zip(SEGMENTS, rows, strict=True) if k},
        working_range=found.working_range,
        straight_part=straight,
    )
