"""Margin of a fleet: the force that gears to come need at a deformation."""

import math
from typing import Literal

from hdcal.data.theory_names import SPRING
from hdcal.errors import Finding, Findings, NotUsable
from hdcal.fleets.next_gear import (
    CONFIDENCE,
    CONTENTS,
    NextForce,
    force_findings,
    next_force,
)
from hdcal.fleets.posterior import FleetFacts, FleetPosterior
from hdcal.prediction.shares import share_findings
from hdcal.report.item import INTERVAL
from hdcal.report.result import Result


class FleetMargin(NextForce, Result):
    """The force of gears to come, from the population of a fleet."""

    template = "fleets/margin.md.j2"
    table = "bounds"

    format: Literal["hdcal.fleet-margin/1"] = "hdcal.fleet-margin/1"
    interval: float = INTERVAL
    fleet: FleetFacts


def fleet_margin(
    posterior: FleetPosterior,
    deformation: float,
    limit_force: float | None = None,
    *,
    content: float | None = None,
    confidence: float = CONFIDENCE,
) -> FleetMargin:
    """Return the force that gears to come need at a deformation.

    Args:
        posterior: of a fleet.
        deformation: as read, with the sign of the data [mm].
        limit_force: a capacity, its size [N].
        content: share of gears to come that keep each bound; by default there are
            bounds of 90 and 99 %.
        confidence: of each bound.

    Raises:
        InputError: a number is impossible, or in another unit.
        NotUsable: the fleet failed its checks.
    """
    facts, units, draws = posterior.facts, posterior.units, posterior.draws
    reach = math.inf if facts.reach_mm is None else facts.reach_mm
    with Findings() as wrong:
        given = deformation, limit_force, facts.largest_mm, reach, units
        wrong += force_findings(*given)
        shares = {"confidence": confidence}
        shares |= {} if content is None else {"content": content}
        wrong += share_findings(shares, len(draws["stiffness"]))
        if content is not None and 0.0 < content <= 0.5:
            words = f"{content:g} is no more than half of the gears to come"
            wrong.append(Finding("content", words, "Ask for more than 0.5"))
    if posterior.reasons:
        raise NotUsable("this fleet failed its checks: " + "; ".join(posterior.reasons))
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
    return FleetMargin(**dict(found), fleet=facts, part=part, units=units)
