"""The JSON answer of a check: what was understood of a case."""

from dataclasses import dataclass
from typing import Annotated, Literal

from hdcal.data.theory_names import Theory
from hdcal.report.answer import Answer, Count, Digest, EffectName, Promise, Real

# Smallest and largest value.
Ends = tuple[float, float]


@dataclass(frozen=True)
class CheckedGear:
    """What the gear file says."""

    name: str
    material: str
    theory: Theory
    deformation: Literal["radial", "diametral"]
    reference_temperature_C: float
    force_resolution_N: float | None


@dataclass(frozen=True)
class StatedError:
    """What a calibration certificate states of a gauge, as the prior of a parameter.

    Attributes:
        standard_uncertainty: U/k.
        unit: of it.
        certificate: as it stands in the gear file.
        words: what comes of it.
    """

    parameter: str
    standard_uncertainty: float
    unit: str
    certificate: str
    words: str


@dataclass(frozen=True)
class RowsByMovement:
    """Number of rows by the movement that led to them.

    Loading is away from the undeformed gear, in compression and in tension.
    """

    loading: Count
    holding: Count
    unloading: Count


@dataclass(frozen=True)
class CheckedData:
    """What was measured; `known` are the covariates and features that can be used."""

    rows: Annotated[int, Promise(minimum=1)]
    runs: tuple[str, ...]
    specimens: tuple[str, ...]
    deformation_mm: Ends
    force_N: Ends
    temperature_C: Ends
    temperature_measured: bool
    direction: RowsByMovement
    known: tuple[str, ...]
    sha256: Digest


@dataclass(frozen=True)
class EffectsInReach:
    """Which effects these data can tell of, and what the others lack."""

    testable: tuple[EffectName, ...]
    not_testable: dict[str, tuple[str, ...]]


@dataclass(frozen=True)
class SpecimenRead:
    """One of several specimens.

    Attributes:
        stiffness_N_per_mm: of parallel straight lines through its runs, as read; NaN
            where its deformation does not change. `hdcal fleet` infers it.
    """

    name: str
    rows: Count
    runs: Count
    stiffness_N_per_mm: Real


@dataclass(frozen=True, kw_only=True)
class CheckAnswer(Answer):
    """What `hdcal check` answers."""

    schema: Literal["hdcal.check/1"] = "hdcal.check/1"
    case: str
    gear: CheckedGear
    certificates: tuple[StatedError, ...]
    data: CheckedData
    specimens: tuple[SpecimenRead, ...] = ()
    effects: EffectsInReach
    notes: tuple[str, ...]
