"""Say which effects many gears have, and how often each one is."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from hdcal.calibration.calibrate import check_effect_priors
from hdcal.cli.cluster import completed_on_cluster
from hdcal.cli.processes import run_all
from hdcal.data.case import Case
from hdcal.data.measurements.bad_gears import offer
from hdcal.data.plausible import implausible
from hdcal.diagnosis.library import library_of
from hdcal.errors import Finding, Findings, InputError
from hdcal.evidence.case_evidence import NONE, UNKNOWN
from hdcal.fleets.read_fleet import read_fleet
from hdcal.fleets.readings import FleetReadings
from hdcal.fleets.usable import usable
from hdcal.inference.checks import Check, mixing_checks
from hdcal.inference.diagnostics import have_mixed, mixing
from hdcal.inference.sample import Progress
from hdcal.notebook import Shown
from hdcal.physics.effect import Effect
from hdcal.physics.registry import EFFECTS
from hdcal.shared_causes.frequencies import Frequencies, sample_frequencies
from hdcal.shared_causes.gear_evidence import (
    Weight,
    gears_of,
    saying_little,
    weigh_gear,
)

# What is believed of how often causes are counts, before the data, as one gear does.
_COUNTS = 1.0
# Draws of each chain, and the most where lookalikes mix slowly.
_CHAINS, _DRAWS, _MOST_DRAWS = 4, 1500, 12_000
# A frequency of less than this says nothing of how chains mix.
_RARE = 0.01
# No probability is less: it has a logarithm.
_LEAST = 1e-300
# Probability that what is told of a gear holds.
TOLD = 0.9
# Log odds that are substantial (Jeffreys, Theory of Probability, 1961).
_CLEARLY = 0.5 * np.log(10.0)
_OF_FLEETS = {"runs", "specimens"}
_LOST = "start again"


@dataclass(frozen=True, repr=False)
class FleetCauses(Shown):
    """What many gears have in common.

    Attributes:
        case: their readings.
        causes: none, effects by name and unknown; in each gear one leads.
        share: draws of how often each one is among gears to come, shape (d, k).
        cause: draws of which one each gear has, as its place, shape (d, g).
        chance: of each cause in each gear, given all gears, shape (g, k).
        alone: likewise by its own readings alone, shape (g, k).
        log_evidence: of the readings of each gear by cause, over that of none, shape
            (g, k) [nat].
        checks: of the sampler.
        library: effects that were considered.
        seed: of all random numbers.
    """

    case: Case
    causes: tuple[str, ...]
    share: np.ndarray
    cause: np.ndarray
    chance: np.ndarray
    alone: np.ndarray
    log_evidence: np.ndarray
    checks: tuple[Check, ...]
    library: tuple[str, ...]
    seed: int

    @cached_property
    def of_gears(self) -> list[tuple[str, ...]]:
        """Return the fewest causes of each gear that hold 90 %, the likeliest first.

        Something unknown is among them where one gear by itself, in the mean of those
        alike, leaves it open: as it looks the same in all, many gears make an effect
        that looks like it no surer.
        """
        order = np.argsort(-self.chance, axis=1, kind="stable")
        sorted_chance = np.take_along_axis(self.chance, order, axis=1)
        many = 1 + np.sum(np.cumsum(sorted_chance, axis=1) < TOLD, axis=1)
        sets = [
            tuple(self.causes[k] for k in places[:few])
            for places, few in zip(order, many, strict=True)
        ]
        beside = self.left_open
        return [
            (*own, UNKNOWN) if own[0] in beside and UNKNOWN not in own else own
            for own in sets
        ]

    @property
    def left_open(self) -> frozenset[str]:
        """Return effects beside which gears by themselves leave something unknown."""
        if UNKNOWN not in self.causes:
            return frozenset()
        likeliest = self.chance.argmax(axis=1)
        unknown = np.log(self.alone[:, self.causes.index(UNKNOWN)])
        return frozenset(
            self.causes[k]
            for k in np.unique(likeliest)
            if self.causes[k] not in (NONE, UNKNOWN)
            and np.mean((np.log(self.alone[:, k]) - unknown)[likeliest == k]) < _CLEARLY
        )

    @property
    def reasons(self) -> tuple[str, ...]:
        """Return why the result must not be used; empty where it may."""
        return tuple(c.words for c in self.checks if c.outcome == "failed")


def causes(
    data: Any,
    gear: Path | str | Mapping[str, Any] | None = None,
    *,
    columns: Mapping[str, str] | None = None,
    library: Mapping[str, type[Effect]] | None = None,
    jobs: int = 1,
    scheduler: str | None = None,
    skip_bad: bool = False,
    seed: int = 0,
    progress: Progress | None = None,
) -> FleetCauses:
    """Say which effects many gears have, and how often each one is.

    Every gear is weighed by itself, as `diagnose` does; from these evidences follow the
    frequencies of causes, and from them again what each gear has.

    Args:
        data: readings of many gears, as `fleet` takes them; of Parquet 50,000 rows at
            most.
        gear: as in `read_case`, where no case is given.
        columns: likewise.
        library: effects to consider, by name; by default all of them.
        jobs: processes that share the gears.
        scheduler: address of a Dask scheduler, whose workers weigh them instead.
        skip_bad: leave out gears of which a row is wrong, or that say too little.
        seed: of all random numbers.
        progress: called with (gears done, gears in all).

    Raises:
        InputError: there are too few gears, or one of them cannot be diagnosed.
    """
    with Findings() as wrong:
        wrong += implausible("jobs", jobs)
        wrong += implausible("seed", seed)
        effects = wrong.attempt(library_of, library)
    assert effects is not None
    readings = read_fleet(data, gear, columns=columns, skip_bad=skip_bad)
    case, gears = gears_alone(readings, effects, skip_bad=skip_bad, seed=seed)
    # What differs between mountings and between gears is told of the fleet.
    effects = {n: e for n, e in effects.items() if not e.needs & _OF_FLEETS}
    tasks = [(place, gear, effects, seed) for place, gear in enumerate(gears)]
    if scheduler is None:
        weighed = run_all(weigh_gear, tasks, jobs, progress)
    else:
        weighed = list(completed_on_cluster(weigh_gear, iter(tasks), scheduler, _LOST))
    weights = [weight for _, weight in sorted(weighed, key=lambda one: one[0])]
    return _shared(case, weights, effects, seed)


def gears_alone(
    readings: FleetReadings,
    library: Mapping[str, type[Effect]] = EFFECTS,
    *,
    skip_bad: bool = False,
    seed: int = 0,
) -> tuple[Case, list[Case]]:
    """Return the gears that an answer can rest on, together and each by itself.

    Args:
        readings: of all gears.
        library: effects to consider, by name.
        skip_bad: leave out gears that say too little.
        seed: of the errors of their zeros.

    Raises:
        InputError: holds what is wrong with them, with a finding for each gear.
    """
    readings = usable(readings, skip_bad=skip_bad)[0]
    case, rows = readings.case, int(readings.sums.rows.sum())
    if len(case.records.force) < rows:
        words = (
            f"of {rows} rows {len(case.records.force)} are kept, and each counts here"
        )
        raise InputError([Finding(case.name, words, "Ask it of some of the gears")])
    check_effect_priors(case, {**EFFECTS, **library})
    gears = gears_of(case, seed)
    bad = saying_little(gears)
    if bad and not skip_bad:
        raise InputError([*bad.values(), offer(bad, len(gears))])
    if bad:
        case = usable(readings.without(bad))[0].case
        gears = gears_of(case, seed)
    return case, gears


def _shared(
    case: Case, weights: Sequence[Mapping[str, Weight]], library: Mapping, seed: int
) -> FleetCauses:
    """Return what all gears together say, from what each one says by itself."""
    found = {name for weight in weights for name in weight}
    names = [n for n in (NONE, *library, UNKNOWN) if n in found]
    gain, prior = _tables(weights, names)
    alone = prior * np.exp(gain - gain.max(axis=1, keepdims=True))
    drawn, told = _sampled(gain, prior.mean(axis=0), names, seed)
    return FleetCauses(
        case=case,
        causes=tuple(names),
        share=drawn.share.reshape(-1, len(names)),
        cause=drawn.cause.reshape(-1, len(weights)),
        chance=drawn.chance,
        alone=np.maximum(alone / alone.sum(axis=1, keepdims=True), _LEAST),
        log_evidence=gain,
        checks=mixing_checks(mixing(told), _CHAINS),
        library=tuple(library),
        seed=seed,
    )


def _sampled(
    gain: np.ndarray, prior: np.ndarray, names: Sequence[str], seed: int
) -> tuple[Frequencies, dict[str, np.ndarray]]:
    """Return draws, as many as lookalikes take to mix, and those that must have."""
    rng, draws = np.random.default_rng(seed), _DRAWS
    counts = _COUNTS * prior / prior.sum()
    while True:
        drawn = sample_frequencies(gain, counts, rng, chains=_CHAINS, draws=draws)
        common = drawn.share.mean(axis=(0, 1)) >= _RARE
        told = {n: drawn.share[..., k] for k, n in enumerate(names) if common[k]}
        draws *= 2
        if draws > _MOST_DRAWS or have_mixed(told):
            return drawn, told


def _tables(
    weights: Sequence[Mapping[str, Weight]], names: Sequence[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Return log evidence over none and prior of each cause, shape (g, k).

    What a gear's readings cannot show leaves them as probable as nothing does.
    """
    gain, prior = np.zeros((2, len(weights), len(names)))
    for gear, weight in enumerate(weights):
        for cause, told in weight.items():
            place, over = names.index(cause), weight[NONE].log_evidence
            gain[gear, place] = told.log_evidence - over
            prior[gear, place] = np.exp(told.log_prior)
    return gain, prior
