"""The population of a fleet as draws: all that gears to come hang on, saved and loaded.

It is `posterior.nc` in the folder of a fleet.
"""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hdcal.data.plausible import implausible
from hdcal.data.typed_json import typed_text
from hdcal.errors import Finding, Findings, InputError, NotUsable
from hdcal.fleets.fleet_facts import POSITIVE, FleetFacts, facts_of
from hdcal.fleets.next_force import (
    CONTENTS,
    NextForce,
    deformation_findings,
    next_force,
)
from hdcal.fleets.next_gear import CONFIDENCE
from hdcal.inference import posterior_file
from hdcal.inference.array_tree import ArrayTree, group_of, joined
from hdcal.inference.posterior_limits import check_draws

if TYPE_CHECKING:
    import xarray as xr

    from hdcal.fleets.fleet import Fleet

_NEXT = "stiffness"
# Of a deformation: not farther out than what was read.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class FleetPosterior:
    """What is known of the population of a fleet.

    Attributes:
        arrays: of the group posterior the draws of the population by site, of the group
            predictions the stiffness of a gear to come [N/mm as read]; chains by draws.
        facts: what they rest on.
    """

    arrays: ArrayTree
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
        return joined(self.arrays.groups["posterior"])

    @property
    def tree(self) -> "xr.DataTree":
        """What ArviZ draws from: its groups as a DataTree."""
        return self.arrays.datatree

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
            wrong += deformation_findings(deformation, facts.largest_mm, reach)
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
        return posterior_file.sealed(self.arrays, posterior_file.FLEET, attributes)

    @classmethod
    def load(cls, path: Path | str) -> "FleetPosterior":
        """Read the posterior of a fleet back.

        Args:
            path: a result folder of a fleet, or its posterior.nc.

        Raises:
            InputError: the file is missing, damaged, changed, from another version or
                of no fleet.
        """
        file, kind = posterior_file.file_of(path), posterior_file.FLEET
        tree = posterior_file.open_tree(file, kind)
        posterior_file.check_unchanged(tree, file, kind)
        try:
            found = cls(tree, typed_text(FleetFacts, tree.attrs["fleet"]))
            _check_population(found)
        except (KeyError, ValueError, TypeError, AttributeError) as error:
            damaged = posterior_file.not_a_posterior(file, kind)
            raise InputError([damaged]) from error
        return found

    @classmethod
    def of(cls, found: "Fleet") -> "FleetPosterior":
        """Return the population of a fleet."""
        facts = facts_of(found)
        chains = facts.settings.chains
        drawn = {name: v.reshape(chains, -1) for name, v in found.draws.items()}
        population = group_of(drawn)
        said = {name: {"units": unit} for name, unit in facts.units.items()}
        for kind, names in facts.groups.items():
            for place, name in enumerate(names, 1):
                said.setdefault(f"{kind}_{place}", {})["long_name"] = name
        for name in said.keys() & drawn.keys():
            population[name] = population[name]._replace(said=said[name])
        ahead = group_of({_NEXT: found.next_stiffness.reshape(chains, -1)})
        ahead[_NEXT] = ahead[_NEXT]._replace(said={"units": "N/mm"})
        return cls(ArrayTree({"posterior": population, "predictions": ahead}), facts)


def _share_findings(shares: Mapping[str, float], draws: int) -> Iterator[Finding]:
    # Late: it is not needed to fit a fleet.
    from hdcal.prediction.shares import check_rarity, check_shares

    yield from check_shares(**shares)
    yield from check_rarity(shares, draws)
    if 0.0 < shares.get("content", 1.0) <= 0.5:
        words = f"{shares['content']:g} is no more than half of the gears to come"
        yield Finding("content", words, "Ask for more than 0.5")


def _check_population(found: FleetPosterior) -> None:
    """Check that draws are whole, whoever wrote them.

    Raises:
        KeyError, ValueError: they are not.
    """
    draws = found.draws
    drawn = found.arrays.groups["posterior"]
    chains = len(drawn["stiffness"].values)
    if not found.facts.checks or chains != found.facts.settings.chains:
        raise ValueError("has other chains, or no checks")
    if draws.keys() != found.facts.units.keys():
        raise ValueError("has other sites than a population")
    check_draws(drawn, dict.fromkeys(draws, ()))
    ahead = found.arrays.groups["predictions"][_NEXT].values
    if ahead.shape != drawn["stiffness"].values.shape:
        raise ValueError("has another number of gears to come")
    if not np.isfinite(ahead).all():
        raise ValueError("has a gear to come that is not finite")
    scatter = [f"{kind}_sd" for kind in found.facts.groups]
    if any(np.min(draws[name]) < 0.0 for name in [*POSITIVE, *scatter]):
        raise ValueError("has a scatter below nothing")
    if np.max(draws["off_share"]) > 1.0 or np.min(draws["stiffness"]) <= 0.0:
        raise ValueError("has numbers that no population has")
