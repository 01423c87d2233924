"""What the draws of a fleet's population rest on, typed: whoever wrote the file."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from hdcal.data.gear_file.validation import within
from hdcal.data.theory_names import Theory
from hdcal.fleets.typed_json import STRICT, Count, Number, Size, typed
from hdcal.inference.checks import Check
from hdcal.quantities import BY_LOAD, FORCE, Quantities
from hdcal.versions import versions

if TYPE_CHECKING:
    from hdcal.fleets.fleet import Fleet

# Sites of every population, with their units; none of the positive ones is below 0.
POSITIVE = {
    "stiffness": "N/mm",
    "specimen_sd": "1",
    "run_offset_sd": "N",
    "sigma": "N",
    "noise_spread": "1",
    "off_share": "1",
    "off_ratio": "1",
}
_SITES = {**POSITIVE, "zero": "N"}


@dataclass(frozen=True)
class FleetSettings:
    """How a population was sampled."""

    __pydantic_config__: ClassVar = STRICT
    seed: Annotated[int, within("seed")]
    chains: Annotated[int, within("chains")]
    warmup: Annotated[int, within("warmup")]
    draws: Annotated[int, within("draws")]
    sampler: str


@dataclass(frozen=True)
class FleetFacts:
    """What the draws of a population rest on.

    Attributes:
        name: of the data.
        theory: of the gear file.
        gears: how many were measured.
        rows: readings of all of them.
        data_sha256: of the data.
        largest_mm: deformation that was read, with its sign.
        unit: stiffness at K = 1 [N/mm as read].
        at_one_size: whether gears of several sizes were compared at the gear file's.
        lots: their names, in the order of lot_1, … of the draws.
        operators: likewise of operator_1, ….
        rigs: likewise of rig_1, ….
        notes: what the reader of the fleet was told.
        checks: of the sampler.
        settings: of the run.
        versions: of the packages that made them.
        reach_mm: deformation as read that no gear of this radius reaches; None where
            no radius is known.
        load: what was measured over a displacement: force or torque.
    """

    __pydantic_config__: ClassVar = STRICT
    name: str
    theory: Theory
    gears: Count
    rows: Count
    data_sha256: str
    largest_mm: Number
    unit: Size
    at_one_size: bool
    lots: tuple[str, ...]
    operators: tuple[str, ...]
    rigs: tuple[str, ...]
    notes: tuple[str, ...]
    checks: tuple[Check, ...]
    settings: FleetSettings
    versions: dict[str, str]
    reach_mm: Size | None
    load: Literal["force", "torque"] = FORCE.load

    @property
    def groups(self) -> Mapping[str, tuple[str, ...]]:
        """Lots, operators and rigs, where they are told."""
        told = {"lot": self.lots, "operator": self.operators, "rig": self.rigs}
        return {kind: names for kind, names in told.items() if names}

    @property
    def quantities(self) -> Quantities:
        """Names and units of what was measured."""
        return BY_LOAD[self.load]

    @property
    def units(self) -> Mapping[str, str]:
        """Unit of each site that a draw of this population holds."""
        units = dict(_SITES)
        for kind, names in self.groups.items():
            unit = "N" if kind == "operator" else "1"
            each = [f"{kind}_{k}" for k in range(1, len(names) + 1)]
            units |= dict.fromkeys([f"{kind}_sd", *each], unit)
            units[f"{kind}_ratio"] = "1"
        return {name: self.quantities.unit(unit) for name, unit in units.items()}


def facts_of(found: "Fleet") -> FleetFacts:
    """Return what the draws of a fleet rest on."""
    # Late: words take what a fleet is made of.
    from hdcal.fleets.notes import notes_of
    from hdcal.fleets.over_time import time_answer, time_series
    from hdcal.fleets.time_words import time_words

    case = found.case
    times = map(time_answer, time_series(found))
    changes = [time_words(one) for one in times if one.changed]
    how = {one.name: found.settings[one.name] for one in fields(FleetSettings)}
    return FleetFacts(
        name=case.name,
        theory=case.gear.theory,
        gears=len(found.off),
        rows=int(found.rows.sum()),
        data_sha256=case.data_sha256,
        largest_mm=found.readings.largest,
        unit=found.unit,
        at_one_size=found.at_one_size,
        lots=tuple(found.lots),
        operators=tuple(found.operators),
        rigs=tuple(found.rigs),
        notes=tuple(map(case.units.say, (*changes, *notes_of(found)))),
        checks=found.checks,
        settings=typed(FleetSettings, how),
        versions=versions(),
        reach_mm=case.gear.reach if math.isfinite(case.gear.reach) else None,
        load=case.units.load,
    )
