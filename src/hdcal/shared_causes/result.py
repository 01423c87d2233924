"""The causes of many gears as a result."""

from typing import Literal

from pydantic import Field, InstanceOf

from hdcal.inference.checks import Check
from hdcal.report.item import (
    INTERVAL,
    Count,
    Digest,
    EffectName,
    Interval,
    Item,
    Probability,
    Words,
)
from hdcal.report.result import Result
from hdcal.shared_causes.gear_evidence import NONE

# Less frequent causes are in the JSON alone.
RARE = 0.01


class SharedCause(Item):
    """One cause, which may be none or outside the library, over all gears.

    It is named for gears in which it alone has a probability of 0.9 or more. `gears`
    is the number that have it, `share` that among future gears. The log evidence
    is the natural log of the Bayes factor, if all gears have it, against no effect.
    """

    cause: EffectName
    gears_named: Count
    gears: Interval
    share: Interval
    log_evidence_nat: float


class GearCauses(Item):
    """One gear: a row of gears.csv.

    Attributes:
        causes: the fewest with a probability of 0.9, the most probable first.
        probability: of the most probable cause, given all gears.
        alone: the most probable cause by the readings of this gear alone.
    """

    gear: Words
    lot: str | None = None
    rows: Count | None = None
    causes: str = ""
    probability: Probability | None = None
    probability_none: Probability | None = None
    alone: str = ""
    probability_alone: Probability | None = None
    status: Words

    @property
    def kind(self) -> tuple[str, ...]:
        """The causes; empty where it is not clear whether there is any effect."""
        names = tuple(self.causes.split(" / "))
        return () if NONE in names and names != (NONE,) else names


class FleetCauses(Result):
    """Result of `hdcal causes`; summary.json.

    Attributes:
        left_out: reason for each gear that is in none of the numbers.
        causes: that were considered, the most frequent first.
        not_shown: effects of the library without a prediction for any gear.
        confounded: causes that the readings of one gear do not separate from something
            outside the library.
    """

    template = "shared_causes/report.md.j2"
    table = "each_gear"

    format: Literal["hdcal.causes/3"] = "hdcal.causes/3"
    interval: float = INTERVAL
    gears: Count
    rows: Count
    left_out: dict[str, Words]
    causes: tuple[SharedCause, ...]
    not_shown: tuple[EffectName, ...]
    confounded: tuple[EffectName, ...]
    notes: tuple[str, ...]
    seed: Count
    draws: Count
    versions: dict[str, str]
    data_sha256: Digest
    each_gear: tuple[GearCauses, ...] = Field(exclude=True)
    checks: tuple[InstanceOf[Check], ...] = Field(exclude=True)
    name: str = Field(exclude=True)

    @property
    def kinds(self) -> dict[tuple[str, ...], list[str]]:
        """Gears by their causes, the most frequent first."""
        kinds: dict[tuple[str, ...], list[str]] = {}
        for gear in self.each_gear[: self.gears]:
            kinds.setdefault(gear.kind, []).append(gear.gear)
        return dict(sorted(kinds.items(), key=lambda item: -len(item[1])))

    @property
    def common(self) -> tuple[SharedCause, ...]:
        """Causes that are frequent enough to be shown."""
        return tuple(c for c in self.causes if c.share.median >= RARE or c.gears_named)
