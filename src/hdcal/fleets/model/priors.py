"""Priors of the population of each quantity of the gears."""

import numpy as np

from hdcal.data.case import Case
from hdcal.data.prior import Prior
from hdcal.evidence.base_model import moments, stiffness_prior
from hdcal.inference.force_model.priors import problem_priors

_JUDGED = "engineering judgement: "
ODD_STIFFNESS = Prior("beta", (1.0, 9.0), "1", _JUDGED + "one gear in ten is odd")
ODD = Prior("beta", (1.0, 99.0), "1", _JUDGED + "one gear in a hundred is odd")
ODD_RATIO = Prior(
    "lognormal",
    (6.0, 0.7),
    "1",
    _JUDGED + "odd gears lie some six times as far out as ordinary ones",
)
NOISE_SPREAD = Prior(
    "lognormal",
    (0.1, 1.2),
    "1",
    _JUDGED + "the noise of gears on one rig differs by 1 to 100 %",
)
GROUP_RATIO = Prior(
    "lognormal",
    (0.7, 1.2),
    "1",
    _JUDGED + "lots scatter about as gears of one lot do, seldom a tenth of it or "
    "seven times as far; zeros of operators as those of mountings, gains of rigs as "
    "gears",
)
# Shares of the largest force: a loop or a bend of all gears, and how much gears differ,
# by a factor of some four either way.
_SHAPE, _SHAPE_SPREAD, _SHAPE_LOG_SD = 0.05, 0.005, 1.4


def population_priors(case: Case) -> tuple[float, dict[str, Prior]]:
    """Return the stiffness at K = 1 [N/mm as read], and the priors of a population."""
    own = problem_priors(case, (), {}, case.gear.theory)
    half = 0.5 if case.gear.reading == "diametral" else 1.0
    log_mean, log_sd, nominal = stiffness_prior(case, own)
    centre = half * float(np.exp(log_mean))
    zero, gauge_sd = moments(own, "force_offset")
    contact, contact_sd = moments(own, "deformation_offset")
    zero_sd = float(np.hypot(gauge_sd, centre * contact_sd))
    return half * nominal, {
        "stiffness": Prior("lognormal", (centre, log_sd)),
        "zero": Prior("normal", (zero - centre * contact, zero_sd)),
        **{name: own[name] for name in ("specimen_sd", "run_offset_sd", "sigma")},
    }


def shape_priors(largest_force: float) -> tuple[Prior, Prior]:
    """Return the priors of the loop or bend of all gears, and of its scatter [N]."""
    scatter = _SHAPE_SPREAD * largest_force
    return (
        Prior("normal", (0.0, _SHAPE * largest_force)),
        Prior("lognormal", (scatter, _SHAPE_LOG_SD)),
    )
