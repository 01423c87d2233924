"""From what mountings say to the problem that is sampled."""

import numpy as np

from hdcal.data.case import Case
from hdcal.data.prior import Prior
from hdcal.data.scatter import reading_step
from hdcal.evidence.prepare import moments, stiffness_prior
from hdcal.fleets.groups import groups, lot_grouping, operator_grouping
from hdcal.fleets.readings import FleetReadings
from hdcal.inference.gear_sums import gear_sums
from hdcal.inference.population_problem import (
    GROUP_RATIO,
    POPULATION_PRIORS,
    PopulationProblem,
)
from hdcal.inference.problem import problem_priors


def fleet_problem(readings: FleetReadings) -> tuple[PopulationProblem, float]:
    """Return the problem, and the stiffness at K = 1 [N/mm as read]."""
    case, sums = readings.case, readings.sums
    lots, lot = groups(case.lots)
    lot = lot if lots else np.zeros(len(case.specimen_labels), int)
    told = {"lot": lot_grouping(sums, lot)} if lots else {}
    told |= {"operator": operator_grouping(sums)} if groups(case.operators)[0] else {}
    unit, priors = _priors(case)
    priors |= {f"{kind}_ratio": GROUP_RATIO for kind in told}
    problem = PopulationProblem(priors, gear_sums(sums, lot, reading_step(case)), told)
    return problem, unit


def _priors(case: Case) -> tuple[float, dict[str, Prior]]:
    """Return the stiffness at K = 1 [N/mm as read], and the priors of all sites."""
    own = problem_priors(case, (), {}, case.gear.theory)
    half = 0.5 if case.gear.reading == "diametral" else 1.0
    log_mean, log_sd, nominal, _ = stiffness_prior(case, own)
    centre = half * float(np.exp(log_mean))
    zero, gauge_sd = moments(own["force_offset"])
    place, contact_sd = moments(own["deformation_offset"])
    zero_sd = float(np.hypot(gauge_sd, centre * contact_sd))
    return half * nominal, {
        "stiffness": Prior("lognormal", (centre, log_sd)),
        "zero": Prior("normal", (zero - centre * place, zero_sd)),
        **{name: own[name] for name in ("specimen_sd", "run_offset_sd", "sigma")},
        **POPULATION_PRIORS,
    }
