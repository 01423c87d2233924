"""Say which effects many gears have, and how often each one is."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hdcal.calibration.calibrate import check_effect_priors
from hdcal.cli.cluster import completed_on_cluster
from hdcal.cli.processes import run_all
from hdcal.data.case import Case, require_case
from hdcal.data.plausible import implausible
from hdcal.errors import Findings
from hdcal.evidence.case_evidence import NONE, UNKNOWN
from hdcal.fleets.readings import check_fleet, fleet_readings
from hdcal.inference.checks import Check, mixing_checks
from hdcal.inference.diagnostics import mixing
from hdcal.inference.sample import Progress
from hdcal.notebook import Shown
from hdcal.physics.effect import Effect
from hdcal.physics.registry import EFFECTS
from hdcal.shared_causes.frequencies import sample_frequencies
from hdcal.shared_causes.gear_evidence import SEVERAL, Weight, gears_of, weigh_gear

# What is believed of how often causes are counts, before the data, as one gear does.
_COUNTS = 1.0
_CHAINS = 4
# A frequency of less than this says nothing of how chains mix.
_RARE = 0.01
# Probability that what is told of a gear holds.
TOLD = 0.9
_OF_FLEETS = {"runs", "specimens"}
_LOST = "start again"


@dataclass(frozen=True, repr=False)
class FleetCauses(Shown):
    """What many gears have in common.

    Attributes:
        case: their readings.
        causes: none, effects by name, several at once and unknown; each gear has one.
        share: draws of how often each one is among gears to come, shape (d, k).
        number: draws of how many of these gears have each one, shape (d, k).
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
    number: np.ndarray
    chance: np.ndarray
    alone: np.ndarray
    log_evidence: np.ndarray
    checks: tuple[Check, ...]
    library: tuple[str, ...]
    seed: int

    @property
    def of_gears(self) -> list[tuple[str, ...]]:
        """Return the fewest causes of each gear that hold 90 %, the likeliest first."""
        order = np.argsort(-self.chance, axis=1, kind="stable")
        sorted_chance = np.take_along_axis(self.chance, order, axis=1)
        many = 1 + np.sum(np.cumsum(sorted_chance, axis=1) < TOLD, axis=1)
        return [
            tuple(self.causes[k] for k in places[:few])
            for places, few in zip(order, many, strict=True)
        ]

    @property
    def reasons(self) -> tuple[str, ...]:
        """Return why the result must not be used; empty where it may."""
        return tuple(c.words for c in self.checks if c.outcome == "failed")


def causes(
    case: Case,
    *,
    library: Mapping[str, type[Effect]] = EFFECTS,
    jobs: int = 1,
    scheduler: str | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> FleetCauses:
    """Say which effects many gears have, and how often each one is.

    Every gear is weighed by itself, as `diagnose` does; from these evidences follow the
    frequencies of causes, and from them again what each gear has.

    Args:
        case: from `read_case`, whose rows name their specimen.
        library: effects to consider, by name.
        jobs: processes that share the gears.
        scheduler: address of a Dask scheduler, whose workers weigh them instead.
        seed: of all random numbers.
        progress: called with (gears done, gears in all).

    Raises:
        InputError: there are too few gears, or one of them cannot be diagnosed.
    """
    require_case(case)
    with Findings() as wrong:
        wrong += implausible("jobs", jobs)
        wrong += implausible("seed", seed)
    gears = check_gears(case, library)
    # What differs between mountings and between gears is told of the fleet.
    library = {n: e for n, e in library.items() if not e.needs & _OF_FLEETS}
    tasks = [(place, gear, dict(library), seed) for place, gear in enumerate(gears)]
    if scheduler is None:
        weighed = run_all(weigh_gear, tasks, jobs, progress)
    else:
        weighed = list(completed_on_cluster(weigh_gear, iter(tasks), scheduler, _LOST))
    weights = [weight for _, weight in sorted(weighed, key=lambda one: one[0])]
    return _shared(case, weights, library, seed)


def check_gears(
    case: Case, library: Mapping[str, type[Effect]] = EFFECTS
) -> list[Case]:
    """Return each gear's rows as a case of its own.

    Args:
        case: readings of all of them.
        library: effects to consider, by name.

    Raises:
        InputError: holds what is wrong with them, with a finding for each gear.
    """
    check_fleet(fleet_readings(case))
    check_effect_priors(case, {**EFFECTS, **library})
    return gears_of(case)


def _shared(
    case: Case, weights: Sequence[Weight], library: Mapping, seed: int
) -> FleetCauses:
    """Return what all gears together say, from what each one says by itself."""
    found = {name for weight in weights for name in weight}
    names = [n for n in (NONE, *library, SEVERAL, UNKNOWN) if n in found]
    nothing = 0.0, 0.0
    both = np.array([[one.get(name, nothing) for name in names] for one in weights])
    alone, prior = both[..., 0], both[..., 1]
    # What a gear's readings cannot show leaves them as probable as nothing does.
    shown = prior > 0.0
    odds = np.log(np.maximum(alone, 1e-300) / np.where(shown, prior, 1.0))
    gain = np.where(shown, odds - odds[:, :1], 0.0)
    before = prior.mean(axis=0)
    counts = _COUNTS * before / before.sum()
    rng = np.random.default_rng(seed)
    drawn = sample_frequencies(gain, counts, rng, chains=_CHAINS)
    common = drawn.share.mean(axis=(0, 1)) >= _RARE
    told = {n: drawn.share[..., k] for k, n in enumerate(names) if common[k]}
    return FleetCauses(
        case=case,
        causes=tuple(names),
        share=drawn.share.reshape(-1, len(names)),
        number=drawn.number.reshape(-1, len(names)),
        chance=drawn.chance,
        alone=alone,
        log_evidence=gain,
        checks=mixing_checks(mixing(told), _CHAINS),
        library=tuple(library),
        seed=seed,
    )
