"""Margin: the force that a deformation needs, and whether it keeps a limit.

A bound with content p and confidence γ: in each draw of the posterior the force that
the share p of the members does not exceed; of these the quantile γ over the draws.
With a normal population and the reference prior it is the classical tolerance limit.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from hdcal.data.theory_names import SPRING
from hdcal.inference.force_model.residuals import noise_warnings
from hdcal.prediction.conditions import (
    Conditions,
    Direction,
    Population,
    beyond_tested,
)
from hdcal.prediction.forces import Quantity
from hdcal.prediction.joint import joint
from hdcal.prediction.margin.budget import budget
from hdcal.prediction.margin.levels import Conformity, Level, decide, force_levels
from hdcal.prediction.margin.reached import deformation_reached
from hdcal.prediction.margin.request import MarginRequest, Rule, checked_request
from hdcal.prediction.margin.result import CalibrationSource, Margin
from hdcal.prediction.models import (
    Models,
    averaging_words,
    left_out_of,
    probabilities,
)
from hdcal.prediction.simulate import simulate
from hdcal.prediction.sizes import SIZES


def margin(
    models: Models,
    deformation: float,
    *,
    temperature: float | Sequence[float] | np.ndarray | None = None,
    limit_force: float | None = None,
    given_force: float | None = None,
    content: float = 0.99,
    confidence: float = 0.95,
    population: Population | None = None,
    quantity: Quantity = "reading",
    direction: Direction = "up",
    tolerances: Mapping[str, float] | None = None,
    seed: int = 0,
    rule: Rule | None = None,
) -> Margin:
    """Return the force needed at a deformation, with bounds, and the margin to it.

    Args:
        models: a calibration, a diagnosis, or posteriors with their probabilities.
        deformation: as read [mm].
        temperature: of the specimen [°C]; of several the worst counts. By default
            the tested one nearest to the reference.
        limit_force: capacity [N], a size along the direction of loading, or with its
            sign.
        given_force: force [N] whose deformation is asked for, with its sign.
        content: share of the population within each one-sided bound.
        confidence: of each bound.
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
    model = joint(models)
    asked = checked_request(
        model,
        deformation=deformation,
        temperature=temperature,
        limit_force=limit_force,
        given_force=given_force,
        content=content,
        confidence=confidence,
        population=population,
        quantity=quantity,
        direction=direction,
        tolerances=tolerances,
        rule=rule,
        seed=seed,
    )
    posterior, sign = model.posterior, asked.loading_sense
    case, theory = posterior.case, posterior.theory
    at = Conditions.of(
        asked.deformation_mm,
        asked.temperatures_C,
        sign,
        asked.direction == "down",
        quantity=asked.quantity,
        tolerances={SIZES[n]: by for n, by in asked.tolerances_mm.items() if by > 0.0},
    )
    members = simulate(model, at, asked.population, seed=asked.seed)
    step = float(model.problem.step) if asked.quantity == "reading" else 0.0
    levels = force_levels(model, asked, members, step)
    row = int(np.argmax([level.capacity_N for level in levels]))
    worst, here = levels[row], members.row(row)
    rows, estimate, sd = budget(model, here, step / 12.0**0.5, sign)
    expanded = 0.5 * (worst.member_N.hi - worst.member_N.lo)
    bend = sign * here.common["bend"]
    return Margin(
        **dict(asked),
        levels=levels,
        worst=worst,
        estimate_N=estimate,
        combined_standard_uncertainty_N=sd,
        coverage_factor=expanded / sd,
        expanded_uncertainty_N=expanded,
        budget=rows,
        decision=_decision(asked, worst, estimate),
        reached=deformation_reached(model.models, asked, at, worst.temperature_C, step),
        step_N=step,
        beyond_tested=beyond_tested(asked.deformation_mm, case.records),
        bend_N=(float(bend.mean()), float(bend.std())),
        turn_mm=float(at.turn(case.records)[0]),
        causes=probabilities(model.models),
        weight_left_out=left_out_of(models),
        averaging=tuple(averaging_words(models)),
        warnings=noise_warnings(posterior),
        posterior=posterior,
        data=CalibrationSource(
            gear=case.gear.name,
            theory=theory,
            name=case.name,
            rows=len(case.records.force),
            sha256=case.data_sha256,
        ),
        part="part" if theory == SPRING else "gear",
        units=case.units,
    )


def _decision(asked: MarginRequest, worst: Level, estimate: float) -> Conformity | None:
    if asked.limit_force_N is None or worst.exceedance is None:
        return None
    sign, span = asked.loading_sense, worst.member_N
    low, high = sorted((sign * span.lo, sign * span.hi))
    # The rounding is a component of the interval: it is in the limit only once.
    numbers = asked.limit_force_N, sign * estimate, low, high
    return decide(asked.rule, *numbers, worst.exceedance.probability)
