"""The draws of the population of a fleet, which the forces of new gears rest on.

They are `posterior.nc` in the folder of a fleet.
"""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from hdcal.data.plausible import implausible
from hdcal.errors import Finding, Findings, NotUsable
from hdcal.fleets.fleet_facts import FleetFacts, facts_of
from hdcal.fleets.next_force import (
    CONTENTS,
    NextForce,
    deformation_findings,
    next_force,
)
from hdcal.fleets.next_gear import CONFIDENCE
from hdcal.fleets.typed_json import typed_text
from hdcal.inference.posterior_file import (
    FLEET,
    content,
    file_of,
    not_a_posterior,
    read_tree,
)
from hdcal.inference.posterior_tree import dataset, group_of, joined_draws

if TYPE_CHECKING:
    from hdcal.fleets.fleet import Fleet

_NEXT = "stiffness"
# Of a deformation: not farther out than what was read.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class FleetPosterior:
    """What is known of the population of a fleet.

    Attributes:
        tree: in the group posterior the draws of the population by site, in the group
            predictions the stiffness of a gear to come [N/mm as read]; chains by draws.
        facts: what they rest on.
    """

    tree: xr.DataTree
    facts: FleetFacts

    def __repr__(self) -> str:
        state = "FAILED, do not use" if self.reasons else "usable"
        size = len(self.draws["stiffness"])
        return (
            f"<FleetPosterior of {self.facts.name}: {self.facts.gears} gears, "
            f"{size} draws, {state}>"
        )

    @property
    def draws(self) -> dict[str, np.ndarray]:
        """All draws of the population by site, chains joined, as `Fleet` has them."""
        return joined_draws(self.tree)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Return why the result must not be used; empty where it may."""
        return tuple(c.words for c in self.facts.checks if c.outcome == "failed")

    def next_force(
        self,
        deformation: float,
        limit_force: float | None = None,
        *,
        content: float | None = None,
        confidence: float = CONFIDENCE,
    ) -> NextForce:
        """Return the force that a gear to come needs at a deformation.

        Args:
            deformation: as read, with the sign of the data [mm].
            limit_force: a capacity, its size [N].
            content: share of gears to come that keep each bound; by default there are
                bounds of 90 and of 99 %.
            confidence: of each bound.

        Raises:
            InputError: a number is impossible, or of another unit.
            NotUsable: the fleet failed its checks.
        """
        draws, facts = self.draws, self.facts
        reach = math.inf if facts.reach_mm is None else facts.reach_mm
        shares = {"confidence": confidence}
        shares |= {} if content is None else {"content": content}
        with Findings() as wrong:
            wrong += deformation_findings(
                deformation, facts.largest_mm, reach, facts.quantities
            )
            wrong += implausible("limit_force", limit_force, "sigma")
            wrong += _share_findings(shares, len(draws["stiffness"]))
        if self.reasons:
            raise NotUsable("this fleet failed its checks: " + "; ".join(self.reasons))
        contents = CONTENTS if content is None else (content,)
        about = {"contents": contents, "confidence": confidence}
        seed = facts.settings.seed
        found = next_force(draws, deformation, limit_force, seed, **about)
        tested = abs(facts.largest_mm) * (1.0 + _ROUNDING)
        return replace(
            found,
            units=facts.quantities,
            at_one_size=facts.at_one_size,
            beyond_tested=abs(deformation) > tested,
        )

    def save(self, path: Path | str) -> None:
        """Write the posterior as a NetCDF file that ArviZ opens."""
        Path(path).write_bytes(self.to_netcdf())

    def to_netcdf(self) -> bytes:
        """Return the content of a NetCDF file that ArviZ opens."""
        attributes = {
            "status": "failed" if self.reasons else "ok",
            "fleet": json.dumps(asdict(self.facts)),
        }
        return content(self.tree, FLEET, attributes)

    @classmethod
    def load(cls, path: Path | str) -> "FleetPosterior":
        """Read the posterior of a fleet back.

        Args:
            path: a result folder of a fleet, or its posterior.nc.

        Raises:
            InputError: the file is missing, damaged, changed, from another version or
                of no fleet.
        """
        file = file_of(path)
        tree = read_tree(file, FLEET)
        try:
            found = cls(tree, typed_text(FleetFacts, tree.attrs["fleet"]))
            found._check_draws()
        except (KeyError, ValueError) as error:
            raise not_a_posterior(file, FLEET) from error
        return found

    def _check_draws(self) -> None:
        """Check that the draws are those of the population.

        Raises:
            KeyError, ValueError: they are not.
        """
        if self.draws.keys() != self.facts.units.keys():
            raise ValueError("has other sites than a population")
        drawn = group_of(self.tree, "posterior")["stiffness"]
        if group_of(self.tree, "predictions")[_NEXT].shape != drawn.shape:
            raise ValueError("has another number of gears to come")

    @classmethod
    def of(cls, found: "Fleet") -> "FleetPosterior":
        """Return the population of a fleet."""
        facts = facts_of(found)
        chains = facts.settings.chains
        drawn = {name: v.reshape(chains, -1) for name, v in found.draws.items()}
        population = dataset(drawn, units=facts.units)
        for kind, names in facts.groups.items():
            for place, name in enumerate(names, 1):
                population[f"{kind}_{place}"].attrs["long_name"] = name
        stiffness = found.next_stiffness.reshape(chains, -1)
        ahead = dataset(
            {_NEXT: stiffness}, units={_NEXT: facts.quantities.stiffness_unit}
        )
        groups = {"posterior": population, "predictions": ahead}
        return cls(xr.DataTree.from_dict(groups), facts)


def _share_findings(shares: Mapping[str, float], draws: int) -> Iterator[Finding]:
    # Late: it is not needed to fit a fleet.
    from hdcal.prediction.shares import share_findings

    yield from share_findings(shares, draws)
    if 0.0 < shares.get("content", 1.0) <= 0.5:
        words = f"{shares['content']:g} is no more than half of the gears to come"
        yield Finding("content", words, "Ask for more than 0.5")
