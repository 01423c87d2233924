"""Margin: the force that a deformation needs, and whether it keeps a limit.

A bound with content p and confidence γ: in each draw of the posterior the force that
the share p of the members does not exceed; of these the quantile γ over the draws.
With a normal population and the reference prior it is the classical tolerance limit.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hdcal.data.theory_names import SPRING
from hdcal.inference.force_model.residuals import noise_warnings
from hdcal.prediction.conditions import (
    Conditions,
    Direction,
    beyond_tested,
    direction_of_loading,
    usual_temperature,
)
from hdcal.prediction.forces import Quantity
from hdcal.prediction.margin.budget import budget
from hdcal.prediction.margin.decision import Conformity, decide
from hdcal.prediction.margin.levels import force_levels, model_bounds
from hdcal.prediction.margin.reached import deformation_reached
from hdcal.prediction.margin.request import (
    MarginRequest,
    Rule,
    require_answerable,
    require_numbers,
)
from hdcal.prediction.margin.result import CalibrationSource, Level, Margin
from hdcal.prediction.members import joined
from hdcal.prediction.models import (
    Model,
    Models,
    averaging_words,
    left_out_of,
    models_of,
    probabilities,
)
from hdcal.prediction.population import Population, widest
from hdcal.prediction.simulate import simulate
from hdcal.prediction.sizes import SIZES
from hdcal.report.item import INTERVAL
from hdcal.versions import versions


def margin(
    models: Models,
    deformation: float,
    *,
    temperature: float | Sequence[float] | np.ndarray | None = None,
    limit_force: float | None = None,
    given_force: float | None = None,
    content: float = 0.99,
    confidence: float = 0.95,
    required_probability: float | None = None,
    population: Population | None = None,
    quantity: Quantity = "reading",
    direction: Direction = "up",
    tolerances: Mapping[str, float] | None = None,
    seed: int = 0,
    rule: Rule | None = None,
) -> Margin:
    """Return the force needed at a deformation, with bounds, and the margin to it.

    Args:
        models: a posterior, or several with the probabilities of their models.
        deformation: as read [mm].
        temperature: of the specimen [°C]; of several the worst counts. By default
            the tested one nearest to the reference.
        limit_force: capacity [N], a size along the direction of loading, or with its
            sign.
        given_force: force [N] whose deformation is asked for, with its sign.
        content: share of the population within each one-sided bound.
        confidence: of each bound.
        required_probability: that a capacity is to hold; the content by default.
        population: whose force; by default the widest that the data support.
        quantity: `reading` of the rig's gauge, or `load` on the gear.
        direction: up to load, away from the unloaded gear; down to unload. In tension
            this is the opposite of `predict`, where up is a rising deformation.
        tolerances: ± by wall_thickness_mm, radius_mm, length_mm, load_height_mm.
        seed: of what the draws leave open.
        rule: of the decision about the limit, guarded (by default) or simple.

    Raises:
        NotUsable: a calibration failed its checks.
        InputError: what is asked cannot be answered; holds every finding.
    """
    require_numbers(
        temperature,
        deformation=deformation,
        limit_force=limit_force,
        given_force=given_force,
        content=content,
        confidence=confidence,
        required_probability=required_probability,
    )
    found = models_of(models)
    case = found[0].posterior.case
    warm = usual_temperature(case) if temperature is None else temperature
    asked = MarginRequest(
        deformation=deformation,
        temperature=np.atleast_1d(np.asarray(warm, float)),
        direction_of_loading=direction_of_loading(found, deformation),
        limit_force=None if limit_force is None else abs(limit_force),
        given_force=given_force,
        content=content,
        confidence=confidence,
        required=content if required_probability is None else required_probability,
        population=population or widest(found[0].problem),
        quantity=quantity,
        direction=direction,
        tolerances={n: float(by) for n, by in (tolerances or {}).items()},
        rule=rule or "guarded",
        seed=seed,
    )
    require_answerable(found, asked, limit_force, rule)
    return _answered(found, asked, models)


def _answered(found: tuple[Model, ...], asked: MarginRequest, models: Models) -> Margin:
    posterior, sign = found[0].posterior, asked.direction_of_loading
    at = Conditions.of(
        asked.deformation,
        asked.temperature,
        sign,
        asked.direction == "down",
        quantity=asked.quantity,
        tolerances={SIZES[n]: by for n, by in asked.tolerances.items() if by > 0.0},
    )
    parts = [simulate(m, at, asked.population, seed=asked.seed) for m in found]
    step = float(found[0].problem.step) if asked.quantity == "reading" else 0.0
    levels = force_levels(found, asked, joined(parts), step)
    # The larger bound in size, along the direction of loading.
    outer = [
        level.upper_bound_N if sign > 0 else -level.lower_bound_N for level in levels
    ]
    row = int(np.argmax(outer))
    worst, here = levels[row], [part.row(row) for part in parts]
    rows, estimate, sd = budget(
        found, here, step / 12.0**0.5, sign, posterior.case.units
    )
    expanded = 0.5 * (worst.member_N.hi - worst.member_N.lo)
    whole = joined(here)
    bend = sign * whole.common["bend"][:, 0]
    mean = float(whole.weight @ bend)
    return Margin(
        **_asked(asked),
        **_source(found, models),
        levels=levels,
        worst=worst,
        estimate_N=estimate,
        combined_standard_uncertainty_N=sd,
        coverage_factor=expanded / sd,
        expanded_uncertainty_N=expanded,
        budget=rows,
        decision=_decision(asked, worst, estimate),
        reached=deformation_reached(found, asked, at, worst.temperature_C),
        models=model_bounds(found, here, asked, step),
        beyond_tested=beyond_tested(asked.deformation, posterior.case.records),
        interval=INTERVAL,
        bend_N=(mean, float(whole.weight @ (bend - mean) ** 2) ** 0.5),
        turn_mm=float(at.turn(posterior.case.records)[0]),
    )


def _asked(asked: MarginRequest) -> dict[str, Any]:
    """Return the fields of a margin that state the request."""
    return {
        "deformation_mm": float(asked.deformation),
        "direction": asked.direction,
        "loading_sense": asked.direction_of_loading,
        "quantity": asked.quantity,
        "population": asked.population,
        "content": asked.content,
        "confidence": asked.confidence,
        "required_probability": asked.required,
        "limit_force_N": asked.limit_force,
        "tolerances_mm": dict(asked.tolerances),
        "seed": asked.seed,
    }


def _source(found: tuple[Model, ...], models: Models) -> dict[str, Any]:
    """Return the fields of a margin that state models and data."""
    posterior = found[0].posterior
    case, theory = posterior.case, posterior.theory
    return {
        "causes": probabilities(found),
        "weight_left_out": left_out_of(models),
        "averaging": tuple(averaging_words(models)),
        "warnings": noise_warnings(posterior),
        "posterior": posterior,
        "data": CalibrationSource(
            gear=case.gear.name,
            theory=theory,
            name=case.name,
            rows=len(case.records.force),
            sha256=case.data_sha256,
        ),
        "versions": versions(),
        "part": "part" if theory == SPRING else "gear",
        "units": case.units,
    }


def _decision(asked: MarginRequest, worst: Level, estimate: float) -> Conformity | None:
    if asked.limit_force is None or worst.exceedance is None:
        return None
    sign, span = asked.direction_of_loading, worst.member_N
    low, high = sorted((sign * span.lo, sign * span.hi))
    # The rounding is a component of the interval: it is in the limit only once.
    numbers = asked.limit_force, sign * estimate, low, high
    return decide(asked.rule, *numbers, worst.exceedance.probability)
