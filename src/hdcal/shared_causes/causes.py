"""Which effects many gears have, and how frequent each one is."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hdcal.calibration.known_effects import check_effect_priors
from hdcal.cli.cluster import completed_on_cluster
from hdcal.cli.processes import run_all
from hdcal.data.case import Case, require_force
from hdcal.data.measurements.bad_gears import offer
from hdcal.data.plausible import implausible
from hdcal.diagnosis.decision import TEMPERATURE
from hdcal.diagnosis.library import library_of
from hdcal.errors import Finding, Findings, InputError
from hdcal.evidence.table import OUTSIDE
from hdcal.fleets.reading.read_fleet import read_fleet
from hdcal.fleets.reading.readings import FleetReadings
from hdcal.fleets.reading.usable import usable
from hdcal.inference.checks import mixing_checks
from hdcal.inference.diagnostics import have_mixed, mixing
from hdcal.inference.sample import Progress
from hdcal.physics.effect import Effect
from hdcal.physics.registry import EFFECTS
from hdcal.shared_causes.frequencies import Frequencies, sample_frequencies
from hdcal.shared_causes.gear_evidence import (
    NONE,
    Weight,
    gears_of,
    unusable,
    weigh_gear,
)
from hdcal.shared_causes.result import FleetCauses
from hdcal.shared_causes.summary import fleet_causes

# Number of gears that the prior of the frequencies counts as.
_COUNTS = 1.0
# Draws of each chain, and the most where similar causes mix slowly.
_CHAINS, _DRAWS, _MOST_DRAWS = 4, 1500, 12_000
# The mixing of smaller frequencies is not checked.
_RARE = 0.01
# What differs between runs and between gears is a question to the fleet.
_OF_FLEETS = {"runs", "specimens"}
_LOST = "start again"


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
    """Say which effects many gears have, and how frequent each one is.

    The evidence of every gear is computed as `diagnose` does; from these evidences
    follow the frequencies of causes, and from them the causes of each gear.

    Args:
        data: readings of many gears, as `fleet` takes them; of Parquet 50,000 rows at
            most.
        gear: as in `read_case`, where no case is given.
        columns: likewise.
        library: effects to consider, by name; by default all of them.
        jobs: processes that share the gears.
        scheduler: address of a Dask scheduler, whose workers share them instead.
        skip_bad: leave out gears with a wrong row or with too few readings.
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
    readings = read_fleet(data, gear, columns=columns)
    require_force(readings.case, "causes")
    case, gears = usable_gears(readings, effects, skip_bad=skip_bad)
    effects = {n: e for n, e in effects.items() if not e.needs & _OF_FLEETS}
    tasks = [(place, each, effects, seed) for place, each in enumerate(gears)]
    if scheduler is None:
        weighed = run_all(weigh_gear, tasks, jobs, progress)
    else:
        weighed = list(completed_on_cluster(weigh_gear, iter(tasks), scheduler, _LOST))
    weights = [weight for _, weight in sorted(weighed, key=lambda each: each[0])]
    return _together(case, weights, [*effects], seed)


def usable_gears(
    readings: FleetReadings,
    library: Mapping[str, type[Effect]] = EFFECTS,
    *,
    skip_bad: bool = False,
) -> tuple[Case, list[Case]]:
    """Return the gears that can be diagnosed, as one case and as a case each.

    Args:
        readings: of all gears.
        library: effects to consider, by name.
        skip_bad: leave out gears that cannot be diagnosed.

    Raises:
        InputError: there is a finding for each gear that cannot be used.
    """
    readings = usable(readings, skip_bad=skip_bad)
    case, rows = readings.case, int(readings.sums.rows.sum())
    if len(case.records.force) < rows:
        words = f"only {len(case.records.force)} of {rows} rows fit into memory"
        raise InputError([Finding(case.name, words, "Use fewer gears")])
    check_effect_priors(case, {**EFFECTS, **library})
    gears = gears_of(case)
    bad = unusable(gears)
    if bad and not skip_bad:
        raise InputError([*bad.values(), offer(bad, len(gears))])
    if bad:
        case = readings.without(bad).case
        gears = gears_of(case)
    return case, gears


def _together(
    case: Case,
    weights: Sequence[Mapping[str, Weight]],
    library: Sequence[str],
    seed: int,
) -> FleetCauses:
    """Return frequencies and causes from the evidence of each gear."""
    present = {name for weight in weights for name in weight}
    names = [name for name in (NONE, *library, OUTSIDE) if name in present]
    gain, prior = _tables(weights, names)
    # Log odds are divided as in a diagnosis, where that calibrates probabilities.
    tempered = gain / TEMPERATURE
    alone = prior * np.exp(tempered - tempered.max(axis=1, keepdims=True))
    drawn, checked = _sampled(tempered, prior.mean(axis=0), names, seed)
    return fleet_causes(
        case=case,
        names=names,
        drawn=drawn,
        alone=alone / alone.sum(axis=1, keepdims=True),
        gain=gain,
        checks=mixing_checks(mixing(checked), _CHAINS),
        library=library,
        seed=seed,
    )


def _sampled(
    gain: np.ndarray, prior: np.ndarray, names: Sequence[str], seed: int
) -> tuple[Frequencies, dict[str, np.ndarray]]:
    """Return draws, more of them where chains mix slowly, and those to be checked."""
    rng, draws = np.random.default_rng(seed), _DRAWS
    counts = _COUNTS * prior / prior.sum()
    while True:
        drawn = sample_frequencies(gain, counts, rng, chains=_CHAINS, draws=draws)
        common = drawn.share.mean(axis=(0, 1)) >= _RARE
        checked = {n: drawn.share[..., k] for k, n in enumerate(names) if common[k]}
        draws *= 2
        if draws > _MOST_DRAWS or have_mixed(checked):
            return drawn, checked


def _tables(
    weights: Sequence[Mapping[str, Weight]], names: Sequence[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Return log evidence over none and prior of each cause, shape (g, k).

    An effect without a prediction for a gear has the evidence of none there.
    """
    gain, prior = np.zeros((2, len(weights), len(names)))
    for gear, weight in enumerate(weights):
        for cause, each in weight.items():
            place = names.index(cause)
            gain[gear, place] = each.log_evidence - weight[NONE].log_evidence
            prior[gear, place] = np.exp(each.log_prior)
    return gain, prior
