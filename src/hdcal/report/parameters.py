"""Parameters of a posterior, with their intervals, in the units of people."""

import math
from dataclasses import asdict

from pydantic import Field

from hdcal.data.theory_names import SPRING
from hdcal.inference.diagnostics import Convergence, Driver
from hdcal.inference.posterior import Posterior
from hdcal.physics.effect import parameters
from hdcal.report.item import Interval, Words
from hdcal.report.words import UNITS


class Quantity(Interval):
    """An interval with its unit."""

    unit: Words


class ParameterEstimate(Quantity):
    """A parameter with its sampling quality; NaN where the gear file fixes it.

    Attributes:
        rhat: rank-normalised split R-hat.
        ess_bulk: effective draws for the centre.
        ess_tail: effective draws for the interval's ends.
        contraction: share of the prior's variance that the data removed.
        driven_by: whether the data or the prior decide it.
    """

    rhat: float
    ess_bulk: float
    ess_tail: float
    contraction: float = Field(json_schema_extra={"maximum": 1})
    driven_by: Driver


def unit_of(posterior: Posterior, name: str) -> tuple[str, float]:
    """Return the unit in which a parameter is shown, and its factor."""
    unit, factor = _code_unit(posterior, name)
    return posterior.case.units.unit(unit), factor


def _code_unit(posterior: Posterior, name: str) -> tuple[str, float]:
    if name == "K" and posterior.theory == SPRING:
        return "N/mm", 1.0
    if name in UNITS:
        return UNITS[name]
    effect_name, field = name.split(".")
    effect = next(e for e in posterior.effects if e.name == effect_name)
    return parameters(effect)[field].unit, 1.0


_NONE = math.nan
# Of a parameter that was not sampled, because the gear file fixes it.
_FIXED = Convergence(_NONE, _NONE, _NONE, contraction=0.0, driven_by="prior")


def parameter_estimates(posterior: Posterior) -> dict[str, ParameterEstimate]:
    """Return every parameter's estimate by name, those that were fixed last."""
    found, draws = posterior.diagnoses, posterior.draws
    fixed = [n for n in posterior.priors if n in draws and n not in found]
    return {
        name: _estimate(posterior, name, found.get(name)) for name in (*found, *fixed)
    }


def _estimate(
    posterior: Posterior, name: str, found: Convergence | None
) -> ParameterEstimate:
    unit, factor = unit_of(posterior, name)
    interval = Interval.of(posterior.draws[name] * factor)
    return ParameterEstimate(**dict(interval), unit=unit, **asdict(found or _FIXED))
