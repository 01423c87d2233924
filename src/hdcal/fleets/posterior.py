"""posterior.nc of a fleet: draws of the population, and the margin of gears to come."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import xarray as xr

from hdcal.data.theory_names import SPRING
from hdcal.errors import Finding, Findings, NotUsable
from hdcal.fleets.next_gear import (
    CONFIDENCE,
    CONTENTS,
    NextForce,
    force_findings,
    next_force,
    stiffness_of_gears,
)
from hdcal.inference.posterior_file import (
    FLEET,
    content,
    file_of,
    not_a_posterior,
    read_tree,
)
from hdcal.inference.posterior_tree import dataset, group_of, joined_draws
from hdcal.prediction.conditions import share_findings
from hdcal.quantities import BY_LOAD, Quantities
from hdcal.report.item import INTERVAL, Count, Digest, Item, Words
from hdcal.report.result import Result

if TYPE_CHECKING:
    from hdcal.fleets.result import Fleet

_IN_NEWTONS = ("zero", "run_offset_sd", "sigma", "loop", "bend", "operator")


class FleetFacts(Item):
    """What posterior.nc holds besides the draws.

    Attributes:
        largest_mm: largest deformation that was read, with its sign.
        reach_mm: deformation as read that no gear of this radius reaches.
        at_one_size: whether gears of several sizes were compared at the gear file's.
    """

    name: str
    theory: str
    gears: Count
    rows: Count
    data_sha256: Digest
    largest_mm: float
    reach_mm: float | None
    at_one_size: bool
    load: str
    notes: tuple[Words, ...]
    reasons: tuple[Words, ...]
    seed: Count
    sampling: dict[str, Any]
    versions: dict[str, str]


class FleetMargin(NextForce, Result):
    """The force of gears to come, from the population of a fleet."""

    template = "fleets/margin.md.j2"
    table = "bounds"

    format: Literal["hdcal.fleet-margin/1"] = "hdcal.fleet-margin/1"
    interval: float = INTERVAL
    fleet: FleetFacts


@dataclass(frozen=True)
class FleetPosterior:
    """Population of a fleet.

    The tree holds the draws of the population by site in the group posterior, and the
    stiffness of a gear to come [N/mm as read] in the group predictions.
    """

    tree: xr.DataTree
    facts: FleetFacts

    def __repr__(self) -> str:
        state, facts = "FAILED, do not use" if self.reasons else "usable", self.facts
        return f"<FleetPosterior of {facts.name}: {facts.gears} gears, {state}>"

    @property
    def draws(self) -> dict[str, np.ndarray]:
        """All draws of the population by site, shape (d,)."""
        return joined_draws(self.tree)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why the fleet must not be used; empty if it may be."""
        return self.facts.reasons

    @property
    def units(self) -> Quantities:
        """Names and units of what was measured."""
        return BY_LOAD[self.facts.load]

    def margin(
        self,
        deformation: float,
        limit_force: float | None = None,
        *,
        content: float | None = None,
        confidence: float = CONFIDENCE,
    ) -> FleetMargin:
        """Return the force that gears to come need at a deformation.

        Args:
            deformation: as read, with the sign of the data [mm].
            limit_force: a capacity, its size [N].
            content: share of gears to come that keep each bound; by default there are
                bounds of 90 and 99 %.
            confidence: of each bound.

        Raises:
            InputError: a number is impossible, or in another unit.
            NotUsable: the fleet failed its checks.
        """
        facts, draws, shares = self.facts, self.draws, {"confidence": confidence}
        shares |= {} if content is None else {"content": content}
        reach = math.inf if facts.reach_mm is None else facts.reach_mm
        with Findings() as wrong:
            given = deformation, limit_force, facts.largest_mm, reach, self.units
            wrong += force_findings(*given)
            wrong += share_findings(shares, len(draws["stiffness"]))
            if content is not None and 0.0 < content <= 0.5:
                words = f"{content:g} is no more than half of the gears to come"
                wrong.append(Finding("content", words, "Ask for more than 0.5"))
        if self.reasons:
            words = "this fleet failed its checks: "
            raise NotUsable(words + "; ".join(self.reasons))
        found = next_force(
            draws,
            deformation,
            limit_force,
            tested=facts.largest_mm,
            seed=facts.seed,
            contents=CONTENTS if content is None else (content,),
            confidence=confidence,
        )
        part = "part" if facts.theory == SPRING else "gear"
        return FleetMargin(**dict(found), fleet=facts, part=part, units=self.units)

    def save(self, path: Path | str) -> None:
        """Write a NetCDF file that ArviZ opens."""
        Path(path).write_bytes(self.to_netcdf())

    def to_netcdf(self) -> bytes:
        """Return the content of a NetCDF file that ArviZ opens."""
        attributes = {
            "status": "failed" if self.reasons else "ok",
            "fleet": self.facts.model_dump_json(),
        }
        return content(self.tree, FLEET, attributes)

    @classmethod
    def load(cls, path: Path | str) -> "FleetPosterior":
        """Read the posterior of a fleet from its result folder, or its posterior.nc.

        Raises:
            InputError: the file is missing, damaged, changed, from another version or
                not of a fleet.
        """
        file = file_of(path)
        tree = read_tree(file, FLEET)
        try:
            found = cls(tree, FleetFacts.model_validate_json(tree.attrs["fleet"]))
            group_of(tree, "posterior")["stiffness"]
        except (KeyError, ValueError) as error:
            raise not_a_posterior(file, FLEET) from error
        return found

    @classmethod
    def of(cls, fleet: "Fleet") -> "FleetPosterior":
        """Return the population of a fleet."""
        fit, case = fleet.fit, fleet.readings.case
        chains = int(fit.settings["chains"])
        drawn = {name: v.reshape(chains, -1) for name, v in fit.draws.items()}
        units = {name: fleet.units.unit(_unit(name)) for name in drawn}
        population = dataset(drawn, units=units)
        for kind in ("lot", "operator", "rig"):
            for place, label in enumerate(getattr(fit.groups, f"{kind}s"), 1):
                population[f"{kind}_{place}"].attrs["long_name"] = label
        ahead = stiffness_of_gears(fit.draws).sample(fleet.seed).reshape(chains, -1)
        predicted = dataset({"stiffness": ahead}, units=units)
        reach, names = case.gear.reach, FleetFacts.model_fields
        facts = FleetFacts(
            **{name: getattr(fleet, name) for name in names if hasattr(fleet, name)},
            theory=case.gear.theory,
            load=case.units.load,
            largest_mm=fleet.readings.largest,
            reach_mm=reach if math.isfinite(reach) else None,
        )
        groups = {"posterior": population, "predictions": predicted}
        return cls(xr.DataTree.from_dict(groups), facts)


def _unit(site: str) -> str:
    """Return the unit of a site, in N and mm."""
    if site == "stiffness":
        return "N/mm"
    share = site.endswith(("_share", "_ratio")) or site == "noise_spread"
    return "N" if site.startswith(_IN_NEWTONS) and not share else "1"
