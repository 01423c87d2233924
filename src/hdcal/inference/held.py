"""What the attributes of a posterior file hold as JSON, typed: whoever wrote it."""

from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

from hdcal.data.case import Theory
from hdcal.data.prior import FAMILIES
from hdcal.data.typed_json import PART, RESULT
from hdcal.inference.checks import Check
from hdcal.inference.diagnostics import Diagnosis


@dataclass(frozen=True)
class HeldPrior:
    """A prior, in code units."""

    __pydantic_config__: ClassVar = RESULT
    family: str
    numbers: list[float]
    unit: str
    source: str

    def __post_init__(self) -> None:
        known = FAMILIES.get(self.family)
        if known is None or len(self.numbers) != len(known):
            raise ValueError("is no prior of a family that is known")


Priors = dict[str, HeldPrior]


@dataclass(frozen=True)
class HeldGear:
    """A gear; lengths in mm."""

    __pydantic_config__: ClassVar = RESULT
    name: str
    geometry: dict[str, float]
    material: str
    theory: Theory
    reading: Literal["radial", "diametral"]
    reference_temperature: float
    force_resolution: float
    nominal_deformation: float | None
    priors: Priors
    K_theory: Theory
    source: dict[str, Any]
    scale_priors: Priors
    effect_priors: Priors
    # A file of before there were dynamics is as good as ever for the rest.
    dynamic_priors: Priors = field(default_factory=dict)
    density: float | None = None


@dataclass(frozen=True)
class HeldCase:
    """A case without its rows."""

    __pydantic_config__: ClassVar = RESULT
    name: str
    gear: HeldGear
    known: list[str]
    run_labels: list[str]
    specimen_labels: list[str]
    data_sha256: str
    notes: list[str]


@dataclass(frozen=True)
class HeldSettings:
    """How it was sampled; a file says more than this."""

    __pydantic_config__: ClassVar = PART
    seed: int
    chains: int
    warmup: int
    draws: int
    seconds: float
    versions: dict[str, str]
    with_gap: bool = False
    kind: Literal["static", "dynamic"] = "static"


@dataclass(frozen=True)
class HeldModel:
    """What was sampled, how, and how well."""

    __pydantic_config__: ClassVar = RESULT
    theory: Theory
    effects: list[str]
    priors: Priors
    settings: dict[str, Any]
    diagnoses: dict[str, Diagnosis]
    checks: list[Check]
