"""What the attributes of a posterior file hold as JSON, typed: whoever wrote it."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field, fields
from typing import Annotated, Any, ClassVar, Literal

from hdcal.data.certificates import can_state
from hdcal.data.full_scale import REFERENCE
from hdcal.data.gear_schema import size_faults
from hdcal.data.plausible import range_of
from hdcal.data.prior import FAMILIES
from hdcal.data.prior_checks import (
    family_faults,
    quantity_of_K,
    range_faults,
    sign_faults,
)
from hdcal.data.records import Geometry
from hdcal.data.theory_names import SPRING, Theory
from hdcal.data.typed_json import PART, RESULT, STRICT, Share, Size, within
from hdcal.inference.checks import Check
from hdcal.inference.diagnostics import Diagnosis
from hdcal.inference.hypotheses import HeldOrigin, LeftOut

# The setting that holds the noise sd of the fit before sampling [N].
PILOT_NOISE, LOOP = "pilot_noise_N", "leftover_loop"
# The setting that says how probable each model of the loss of a moving gear is.
LOSS = "loss"
LossModel = Literal["viscous", "dry friction", "both"]


@dataclass(frozen=True)
class HeldPrior:
    """A prior, in code units."""

    __pydantic_config__: ClassVar = STRICT
    family: str
    numbers: list[float]
    unit: str
    source: str

    def __post_init__(self) -> None:
        known = FAMILIES.get(self.family)
        if known is None or len(self.numbers) != len(known):
            raise ValueError("is no prior of a family that is known")
        wrong = family_faults(self.family, self.numbers)
        # K is carried over to other theories, out of its own range perhaps.
        if wrong or range_faults(self.family, self.numbers, "effect"):
            raise ValueError("is a prior of numbers that none has")


Priors = dict[str, HeldPrior]
_Size = Annotated[float, within("size")]
# With Poisson's ratio.
_SIZES = len(fields(Geometry))


@dataclass(frozen=True)
class HeldGeometry:
    """Sizes of a gear [mm], as `Geometry` has them; None for what a spring has not."""

    __pydantic_config__: ClassVar = STRICT
    wall_thickness: _Size | None
    radius: _Size | None
    length: _Size | None
    load_height: _Size | None
    poisson: Annotated[float, within("poisson")] | None


@dataclass(frozen=True)
class HeldFullScale:
    """The largest readings [N, mm]."""

    __pydantic_config__: ClassVar = STRICT
    force: Size = REFERENCE.force
    deformation: Size = REFERENCE.deformation

    def __post_init__(self) -> None:
        if not (self.force > 0.0 and self.deformation > 0.0):
            raise ValueError("has a full scale that no rig has")


def _is_spring(K: HeldPrior | None, E0: HeldPrior | None) -> bool:
    fixed = E0 is not None and (E0.family, E0.numbers) == ("fixed", [1.0])
    return fixed and K is not None and K.unit == "N/mm"


@dataclass(frozen=True)
class HeldGear:
    """A gear; lengths in mm. Its numbers are those that a gear file may hold."""

    __pydantic_config__: ClassVar = STRICT
    name: str
    geometry: HeldGeometry
    material: str
    theory: Theory
    reading: Literal["radial", "diametral"]
    reference_temperature: Annotated[float, within("temperature")]
    force_resolution: float
    nominal_deformation: _Size | None
    priors: Priors
    K_theory: Theory
    source: dict[str, Any]
    scale_priors: Priors
    effect_priors: Priors
    # A file of before there were dynamics is as good as ever for the rest.
    dynamic_priors: Priors = field(default_factory=dict)
    density: Annotated[float, within("density")] | None = None
    gauge_priors: Priors = field(default_factory=dict)
    # Before it was held, priors of effects were those of one rig.
    full_scale: HeldFullScale = field(default_factory=HeldFullScale)

    def __post_init__(self) -> None:
        step = self.force_resolution
        if step != 0.0 and not range_of("force_resolution").holds(step):
            raise ValueError("has a rounding step that no scale has")
        size = {n: one for n, one in asdict(self.geometry).items() if one is not None}
        theories = {self.theory, self.K_theory}
        if theories != {SPRING} and (SPRING in theories or len(size) < _SIZES):
            raise ValueError("lacks the sizes of its theory")
        defined = self.priors.get("K"), self.priors.get("E0")
        if self.theory == SPRING and not _is_spring(*defined):
            raise ValueError("has priors of K and E0 that no spring has")
        if self.nominal_deformation is not None:
            size["nominal_deformation"] = self.nominal_deformation
        if size_faults(size):
            raise ValueError("has sizes that no gear has")
        # Whose values are computed anew for another theory.
        if "K" not in self.priors:
            raise ValueError("has no prior of K")
        for name, prior in self.gauge_priors.items():
            if not can_state(name, prior.family, prior.numbers):
                raise ValueError("has a certificate that no gauge has")
        for name, prior in (
            self.priors | self.scale_priors | self.dynamic_priors
        ).items():
            quantity = quantity_of_K(prior.unit) if name == "K" else name
            given = prior.family, prior.numbers, quantity
            if sign_faults(*given) or range_faults(*given):
                raise ValueError("has priors that no gear has")


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
    seed: Annotated[int, within("seed")]
    chains: Annotated[int, within("chains")]
    warmup: Annotated[int, within("warmup")]
    draws: Annotated[int, within("draws")]
    seconds: Size
    versions: dict[str, str]
    with_gap: bool = False
    kind: Literal["static", "dynamic"] = "static"
    diagnosis: HeldOrigin | None = None
    left_out: LeftOut | None = None
    # Of older files the pilot fit is made anew.
    pilot_noise_N: Size | None = None
    # The leftover of older files does not know loading from unloading.
    leftover_loop: bool = False
    loss: dict[LossModel, Share] | None = None


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

    def check_diagnoses(self, sites: Iterable[str]) -> None:
        """Check that what has a diagnosis is a parameter.

        Args:
            sites: parameters of the model.

        Raises:
            ValueError: something else has one.
        """
        if not self.diagnoses.keys() <= self.priors.keys() & {*sites}:
            raise ValueError("says how well something was sampled that is no parameter")
