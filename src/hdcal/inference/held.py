"""What the attributes of a posterior file hold as JSON, typed: whoever wrote it."""

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from hdcal.data.case import Theory
from hdcal.inference.checks import Check
from hdcal.inference.diagnostics import Diagnosis

_STRICT = ConfigDict(extra="forbid", strict=True)


class HeldPrior(BaseModel):
    """A prior, in code units."""

    model_config = _STRICT
    family: Literal["fixed", "normal", "lognormal", "half_normal", "uniform", "beta"]
    numbers: list[float]
    unit: str
    source: str


Priors = dict[str, HeldPrior]


class HeldGear(BaseModel):
    """A gear; lengths in mm."""

    model_config = _STRICT
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
    dynamic_priors: Priors = {}
    density: float | None = None


class HeldCase(BaseModel):
    """A case without its rows."""

    model_config = _STRICT
    name: str
    gear: HeldGear
    known: list[str]
    run_labels: list[str]
    specimen_labels: list[str]
    data_sha256: str
    notes: list[str]


class HeldSettings(BaseModel):
    """How it was sampled; each kind of calibration may say more."""

    model_config = ConfigDict(extra="allow", strict=True)
    seed: int
    chains: int
    warmup: int
    draws: int
    seconds: float
    versions: dict[str, str]
    with_gap: bool = False
    kind: Literal["static", "dynamic"] = "static"


class HeldModel(BaseModel):
    """What was sampled, how, and how well."""

    model_config = _STRICT
    theory: Theory
    effects: list[str]
    priors: Priors
    settings: HeldSettings
    diagnoses: dict[str, Diagnosis]
    checks: list[Check]
