"""A case: a gear, how it was read, and the records."""

import math
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from hdcal.data.prior import REFERENCE, FullScale, Prior
from hdcal.data.records import Geometry, Records
from hdcal.data.theory_names import SPRING, Theory
from hdcal.errors import Finding, InputError
from hdcal.quantities import FORCE, Quantities
from hdcal.screening.result import Screening

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Gear:
    """The gear file after reading, in mm, °C and N; priors in MPa, 1/K, N and mm.

    Attributes:
        name: free text; untrusted, escape it before showing it in HTML.
        geometry: load_height defaults to length (the open rim); NaN of a spring.
        reference_temperature: where E(T) = E0.
        force_resolution: rounding step of the force reading, 0 = none given.
        priors: K is the influence coefficient under `K_theory`; under `spring` it is
            the stiffness [N/mm], and E0 is 1 MPa by definition.
        source: the TOML as read, for provenance.
        effect_priors: by `effect.parameter`; the names are not checked here.
        dynamic_priors: `mass` only where it is stated, else `mass_ratio`.
        density: of the material [N·s²/mm⁴].
        gauge_priors: those of certificates, by keys of `GAUGE_UNITS`.
        full_scale: largest readings, of which shipped priors are shares.
    """

    name: str
    geometry: Geometry
    material: str
    theory: Theory
    reading: Literal["radial", "diametral"]
    reference_temperature: float
    force_resolution: float
    nominal_deformation: float | None
    priors: dict[str, Prior]
    K_theory: Theory = "ring"
    source: dict = field(default_factory=dict)
    scale_priors: dict[str, Prior] = field(default_factory=dict)
    effect_priors: dict[str, Prior] = field(default_factory=dict)
    dynamic_priors: dict[str, Prior] = field(default_factory=dict)
    density: float | None = None
    gauge_priors: dict[str, Prior] = field(default_factory=dict)
    full_scale: FullScale = REFERENCE

    @property
    def read_as(self) -> str:
        """Kind of the deformation in a word; empty of a spring, which has no radius."""
        is_plain = self.theory == SPRING and self.reading == "radial"
        return "" if is_plain else self.reading

    @property
    def contact(self) -> float:
        """Deformation as read at which the unloaded part is expected [mm]."""
        prior = self.priors["deformation_offset"]
        known = prior.family in ("normal", "fixed", "uniform")
        ends = prior.numbers if prior.family == "uniform" else prior.numbers[:1]
        return float(sum(ends)) / len(ends) if known else 0.0

    @property
    def reach(self) -> float:
        """Deformation as read that no gear of this radius reaches [mm], or inf."""
        radius = float(self.geometry.radius)
        as_read = radius * (2.0 if self.reading == "diametral" else 1.0)
        return math.inf if math.isnan(as_read) else as_read


@dataclass(frozen=True, repr=False)
class Case:
    """Records of one data file on one gear, with their source.

    Attributes:
        run_labels: of each run index, as are operators, rigs and dates (ISO 8601);
            these and lots are empty where nothing is stated.
        specimen_labels: of each specimen index, as are lots.
        columns: quantity -> header with its unit, of headers that are not hdcal's own.
        left_out: specimens left out because of a faulty row, each with the finding.
        excluded: ends of each stretch of deformations as read whose rows were left out,
            because the part gave way or for a working range [mm].
        excluded_sense: sign of the movement whose readings were left out, where one
            branch alone was chosen; 0 where none was.
        screening: None where the rows are not those of a file.
        units: of a torsional spring force and deformation are a torque [N·m] and an
            angle [rad].
    """

    name: str
    gear: Gear
    records: Records
    run_labels: tuple[str, ...]
    specimen_labels: tuple[str, ...]
    data_sha256: str
    notes: tuple[str, ...] = ()
    columns: dict[str, str] = field(default_factory=dict)
    lots: tuple[str, ...] = ()
    operators: tuple[str, ...] = ()
    rigs: tuple[str, ...] = ()
    dates: tuple[str, ...] = ()
    left_out: dict[str, Finding] = field(default_factory=dict)
    excluded: tuple[tuple[float, float], ...] = ()
    excluded_sense: int = 0
    screening: Screening | None = None
    units: Quantities = FORCE

    @property
    def from_unloaded(self) -> np.ndarray:
        """Deformation of each row from the unloaded part, shape (n,) [mm]."""
        return np.asarray(self.records.deformation) - self.gear.contact

    def __repr__(self) -> str:
        rows = len(self.records.force)
        return f"<Case {self.name}: {rows} rows on {self.gear.name!r}>"

    def _repr_html_(self) -> str:
        return self._check()._repr_html_()

    def to_frame(self) -> "pd.DataFrame":
        """Return what was measured, under the headers of hdcal's files."""
        import pandas as pd

        records = self.records
        columns: dict[str, Any] = {
            self.units.header("deformation_mm"): records.deformation,
            self.units.header("force_N"): records.force,
        }
        for header in ("temperature_C", "time_s", "angle_rad", "force_sd_N"):
            name = header.rpartition("_")[0]
            if name in records.known:
                columns[header] = getattr(records, name)
        labels = {"run": self.run_labels, "specimen": self.specimen_labels}
        for name in sorted(labels.keys() & records.known):
            columns[name] = np.array(labels[name])[np.asarray(getattr(records, name))]
        return pd.DataFrame(columns)

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw the readings, by default into new axes of pyplot."""
        return self._check().plot(ax)

    def _check(self) -> Any:
        # Imported by its name: data are below the questions that are asked of them.
        return import_module("hdcal.calibration.check.check").check(self)


def from_contact(case: Case) -> Case:
    """Return a case whose deformations are counted from the unloaded part."""
    gear, zero = case.gear, case.gear.contact
    if zero == 0.0:
        return case
    prior = gear.priors["deformation_offset"]
    places = 2 if prior.family == "uniform" else 1
    moved = (*(n - zero for n in prior.numbers[:places]), *prior.numbers[places:])
    priors = gear.priors | {"deformation_offset": replace(prior, numbers=moved)}
    return replace(
        case,
        gear=replace(gear, priors=priors),
        records=replace(case.records, deformation=case.from_unloaded),
    )


def require_force(case: Case, question: str) -> None:
    """Raise InputError where torques and angles were measured."""
    if not case.units.is_force:
        words = f"{question} needs forces, but the readings are torques over angles"
        remedy = "Use check, calibrate, diagnose, predict, margin, fleet or compare"
        raise InputError([Finding(case.name, words, remedy)])


def require_case(given: object) -> None:
    """Raise InputError unless a case was given."""
    if not isinstance(given, Case):
        words = f"is a {type(given).__name__}, not a Case"
        remedy = "Read it first, as in read_case(data, gear={'radius_mm': 40.0, …})"
        raise InputError([Finding("case", words, remedy)])
