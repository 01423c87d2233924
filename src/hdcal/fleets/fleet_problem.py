"""From what mountings say to the problem that is sampled."""

from collections.abc import Mapping

import numpy as np

from hdcal.data.case import Case
from hdcal.data.prior import Prior
from hdcal.data.scatter import reading_step
from hdcal.evidence.base_model import moments, stiffness_prior
from hdcal.fleets.change_points import middle_sd
from hdcal.fleets.gear_sums import GearSums, MountingSums, gear_sums, stretched
from hdcal.fleets.groupings import Grouping
from hdcal.fleets.groups import (
    groups,
    lot_grouping,
    operator_grouping,
    rig_grouping,
    slopes,
    zeros,
)
from hdcal.fleets.population_problem import (
    GROUP_RATIO,
    POPULATION_PRIORS,
    PopulationProblem,
)
from hdcal.fleets.readings import FleetReadings
from hdcal.inference.problem import problem_priors


def fleet_problem(readings: FleetReadings) -> tuple[PopulationProblem, float]:
    """Return the problem, and the stiffness at K = 1 [N/mm as read]."""
    case, sums = readings.case, readings.sums
    lots, lot = groups(case.lots)
    lot = lot if lots else np.zeros(len(case.specimen_labels), int)
    of_gears = gear_sums(sums, lot, reading_step(case))
    told: dict[str, Grouping] = {}
    if groups(case.rigs)[0]:
        least = _LEAST * float(np.max(np.abs(sums.y)))
        told["rig"] = rig_grouping(sums, max(_noise_sd(of_gears), least))
        sums = _levelled(sums, told)
    told |= {"lot": lot_grouping(sums, lot)} if lots else {}
    told |= {"operator": operator_grouping(sums)} if groups(case.operators)[0] else {}
    unit, priors = population_priors(case)
    priors |= {f"{kind}_ratio": GROUP_RATIO for kind in told}
    return PopulationProblem(priors, of_gears, told), unit


def _levelled(sums: MountingSums, told: Mapping[str, Grouping]) -> MountingSums:
    """Return sums as if rigs had one gain, as far as it seems to differ."""
    if "rig" not in told:
        return sums
    return stretched(sums, 1.0 + told["rig"].offsets[sums.rig])


def _noise_sd(of_gears: GearSums) -> float:
    """Return about how much readings scatter [N]; nought where none do."""
    log_noise = of_gears.log_noise_sd[of_gears.noise_free > 0.0]
    return float(np.exp(np.median(log_noise))) if len(log_noise) else 0.0


# Sds from the centre at which few ordinary gears are.
_FAR = 4.0
# Scatters below which nothing seems to scatter: of stiffness, and in noise sds.
_LEAST = 1e-4


def rough_values(problem: PopulationProblem, sums: MountingSums) -> dict[str, float]:
    """Return about where the population is: a search from there is a short one."""
    sums = _levelled(sums, problem.groups)
    slope, zero = slopes(sums), zeros(sums)
    apart = slope / np.median(slope) - 1.0
    spread, mounted = middle_sd(apart), middle_sd(zero - np.median(zero))
    noise = _noise_sd(problem.sums)
    values = {
        "zero": np.median(zero),
        # With what is believed of it, one in ten, as if of ten more gears.
        "off_share": (1.0 + np.sum(abs(apart) > _FAR * spread)) / (10.0 + len(slope)),
    }
    # A scatter of nought, as of few or of rounded readings, is no place to start from.
    positive = {
        "stiffness": (np.median(slope), 0.0),
        "specimen_sd": (spread, _LEAST),
        "run_offset_sd": (mounted, _LEAST * noise),
        "sigma": (noise, 0.0),
    }
    values |= {name: sd for name, (sd, least) in positive.items() if sd > least}
    free = {name for name, prior in problem.priors.items() if prior.family != "fixed"}
    return {name: float(value) for name, value in values.items() if name in free}


def population_priors(case: Case) -> tuple[float, dict[str, Prior]]:
    """Return the stiffness at K = 1 [N/mm as read], and the priors of all sites."""
    own = problem_priors(case, (), {}, case.gear.theory)
    half = 0.5 if case.gear.reading == "diametral" else 1.0
    log_mean, log_sd, nominal = stiffness_prior(case, own)
    centre = half * float(np.exp(log_mean))
    zero, gauge_sd = moments(own, "force_offset")
    place, contact_sd = moments(own, "deformation_offset")
    zero_sd = float(np.hypot(gauge_sd, centre * contact_sd))
    return half * nominal, {
        "stiffness": Prior("lognormal", (centre, log_sd)),
        "zero": Prior("normal", (zero - centre * place, zero_sd)),
        **{name: own[name] for name in ("specimen_sd", "run_offset_sd", "sigma")},
        **POPULATION_PRIORS,
    }
