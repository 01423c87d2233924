"""The JSON answer of a fleet: what each number in it is."""

from dataclasses import dataclass
from typing import Annotated, Literal

from hdcal.fleets.gauge import GaugeAnswer
from hdcal.fleets.left_out import GearLeftOut
from hdcal.fleets.misfit import Misfit
from hdcal.fleets.next_force import NextForce
from hdcal.fleets.over_time import TimeAnswer
from hdcal.report.answer import Answer, Count, Digest, Promise, Sentences, Words
from hdcal.report.intervals import Interval


@dataclass(frozen=True)
class PopulationAnswer:
    """How gears, mountings and readings scatter; 95 % credible intervals.

    Attributes:
        stiffness_N_per_mm: of the centre of ordinary gears, per mm as read.
        gear_sd_percent: between ordinary gears of a lot.
        lot_sd_percent: between lots; None where none are told apart.
        operator_sd_N: of the zero between operators, likewise.
        rig_sd_percent: of the gain between rigs, likewise.
        mounting_sd_N: of the zero from mounting to mounting.
        reading_sd_N: of single readings.
    """

    stiffness_N_per_mm: Interval
    gear_sd_percent: Interval
    lot_sd_percent: Interval | None
    operator_sd_N: Interval | None
    rig_sd_percent: Interval | None
    mounting_sd_N: Interval
    reading_sd_N: Interval


@dataclass(frozen=True)
class LotAnswer:
    """A lot, with the stiffness about which its ordinary gears scatter."""

    lot: Words
    gears: Count
    stiffness_N_per_mm: Interval


@dataclass(frozen=True)
class OperatorAnswer:
    """An operator, with the zero of their mountings over the mean of all operators."""

    operator: Words
    mountings: Count
    zero_apart_N: Interval


@dataclass(frozen=True)
class RigAnswer:
    """A rig, with how much higher forces it reads than the mean of all rigs."""

    rig: Words
    mountings: Count
    gain_apart_percent: Interval


@dataclass(frozen=True)
class GearBounds:
    """What a share `content` of gears to come is stiffer than, and softer than.

    One-sided each, with the stated confidence.
    """

    content: float
    confidence: float
    stiffer_than_N_per_mm: float
    softer_than_N_per_mm: float


@dataclass(frozen=True)
class FutureGear:
    """A gear not yet measured; 95 % predictive interval, and bounds for many."""

    stiffness_N_per_mm: Interval
    bounds: tuple[GearBounds, ...]


@dataclass(frozen=True, kw_only=True)
class FleetAnswer(Answer):
    """What `hdcal fleet` answers; summary.json. Its gears are in gears.csv.

    Attributes:
        gears: how many there are, without those left out.
        rows: of all of them.
        left_out: gears that are in none of the numbers, where they may be left out.
        called_off: gears that are called off, the surest first.
        off_in: of stiffness, noise, zero and shape those that are called off in it.
        false_calls: share of these that may be ordinary gears, as expected.
        interval: probability that every interval holds.
        at_one_size: whether gears of several sizes were compared at the gear file's,
            of which then all but gears.csv is.
        population: what they come from.
        lots: where they are told.
        operators: likewise.
        rigs: likewise.
        next_gear: one more of them, of another lot.
        next_force: that it needs at a deformation; None where none was asked for.
        gauge_rr: how well one reading of the force tells gears apart.
        over_time: how stiffness, zeros and noise go with the date, where it is told.
        misfit: what the readings have beside straight lines.
        notes: from reading, and on what the answer rests.
        seed: of the draws.
        versions: of the packages that made them.
        data_sha256: of the data file.
    """

    schema: Literal["hdcal.fleet/1"] = "hdcal.fleet/1"
    gears: Count
    rows: Count
    left_out: tuple[GearLeftOut, ...]
    called_off: tuple[Words, ...]
    off_in: dict[str, tuple[Words, ...]]
    false_calls: float
    interval: Annotated[float, Promise(exclusiveMinimum=0, exclusiveMaximum=1)]
    at_one_size: bool
    population: PopulationAnswer
    lots: tuple[LotAnswer, ...]
    operators: tuple[OperatorAnswer, ...]
    rigs: tuple[RigAnswer, ...]
    next_gear: FutureGear
    next_force: NextForce | None
    gauge_rr: GaugeAnswer
    over_time: tuple[TimeAnswer, ...]
    misfit: Misfit
    notes: Sentences
    seed: Count
    versions: Annotated[dict[str, str], Promise(required=["hdcal"])]
    data_sha256: Digest
