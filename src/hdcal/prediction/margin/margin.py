"""Margin: the force that a deformation needs, and whether it keeps a limit.

A bound with content p and confidence γ: in each draw of the posterior the force that
the share p of the members does not exceed; of these the quantile γ over the draws.
With a normal population and the reference prior it is the classical tolerance limit.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import ndtri

from hdcal.data.theory_names import SPRING
from hdcal.inference.residuals import noise_warnings
from hdcal.prediction.conditions import (
    SENSE,
    Conditions,
    Direction,
    beyond_tested,
    direction_of_loading,
    is_tested,
    usual_temperature,
)
from hdcal.prediction.forces import Quantity
from hdcal.prediction.margin.budget import budget
from hdcal.prediction.margin.decision import decide
from hdcal.prediction.margin.reached import deformation_reached
from hdcal.prediction.margin.request import (
    MarginRequest,
    Rule,
    require_answerable,
    require_numbers,
)
from hdcal.prediction.margin.result import (
    CalibrationSource,
    Exceedance,
    Level,
    Margin,
    ModelBound,
)
from hdcal.prediction.members import Members, joined, one_member, over_draws
from hdcal.prediction.models import (
    Model,
    Models,
    averaging_words,
    left_out_of,
    models_of,
    probabilities,
)
from hdcal.prediction.population import Population, widest
from hdcal.prediction.shares import RAREST
from hdcal.prediction.simulate import simulate
from hdcal.prediction.sizes import SIZES
from hdcal.report.item import INTERVAL, Interval
from hdcal.versions import versions

_TAILS = (0.5 * (1.0 - INTERVAL), 0.5, 0.5 * (1.0 + INTERVAL))
# Largest relative Monte Carlo error of a probability that is a number. Of an event that
# n independent draws do not show, the probability is below 3/n with 95 % confidence.
_ROUGH, _UNSEEN = 0.3, 3.0


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
        direction: up to load, away from the unloaded gear; down to unload.
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
    at = Conditions.of(
        asked.deformation,
        asked.temperature,
        asked.direction_of_loading,
        asked.direction == "down",
        quantity=asked.quantity,
        tolerances={SIZES[n]: by for n, by in asked.tolerances.items() if by > 0.0},
    )
    parts = [simulate(m, at, asked.population, seed=asked.seed) for m in found]
    step = float(found[0].problem.step) if asked.quantity == "reading" else 0.0
    levels = _levels(found, asked, joined(parts), step)
    sign, posterior = asked.direction_of_loading, found[0].posterior
    row = int(np.argmax([_outer(level, sign) for level in levels]))
    worst, here = levels[row], [part.row(row) for part in parts]
    rows, estimate, sd = budget(
        found, here, step / 12.0**0.5, sign, posterior.case.units
    )
    expanded = 0.5 * (worst.member_N.hi - worst.member_N.lo)
    bend = np.concatenate([sign * part.common["bend"][:, 0] for part in here])
    weight = np.concatenate([part.weight for part in here])
    mean = float(weight @ bend)
    return Margin(
        deformation_mm=float(asked.deformation),
        direction=asked.direction,
        loading_sense=1 if sign > 0 else -1,
        quantity=asked.quantity,
        population=asked.population,
        content=asked.content,
        confidence=asked.confidence,
        required_probability=asked.required,
        limit_force_N=asked.limit_force,
        tolerances_mm=dict(asked.tolerances),
        levels=levels,
        worst=worst,
        estimate_N=estimate,
        combined_standard_uncertainty_N=sd,
        coverage_factor=expanded / sd,
        expanded_uncertainty_N=expanded,
        budget=rows,
        decision=_decision(asked, worst, estimate, step),
        reached=deformation_reached(found, asked, at, worst.temperature_C),
        models=_each_model(found, here, asked, step),
        causes=probabilities(found),
        weight_left_out=left_out_of(models),
        beyond_tested=beyond_tested(asked.deformation, posterior.case.records),
        interval=INTERVAL,
        seed=asked.seed,
        versions=versions(),
        data=_data(found[0]),
        posterior=posterior,
        bend_N=(mean, float(weight @ (bend - mean) ** 2) ** 0.5),
        averaging=tuple(averaging_words(models)),
        warnings=noise_warnings(posterior),
        turn_mm=float(at.turn(posterior.case.records)[0]),
        part="part" if posterior.theory == SPRING else "gear",
        units=posterior.case.units,
    )


def _levels(
    found: Sequence[Model], asked: MarginRequest, members: Members, step: float
) -> tuple[Level, ...]:
    """Return the force at each temperature.

    A reading lies within half a step of the force: bounds, capacities and the limit are
    for the worst place of the force in a step. The interval of one member has the
    rounding as a component.
    """
    sign, half, weight = asked.direction_of_loading, 0.5 * step, members.weight
    lower, upper, needed = (
        members.quantile(share)
        for share in (1.0 - asked.content, asked.content, asked.required)
    )
    low = over_draws(lower, weight, [1.0 - asked.confidence])[0] - half
    high = over_draws(upper, weight, [asked.confidence])[0] + half
    least, capacity = over_draws(needed, weight, [0.5, asked.confidence]) + half
    mean = over_draws(members.centre, weight, _TAILS)
    one = one_member(members, step / 12.0**0.5)
    member = [one.quantile(tail)[0] for tail in _TAILS]
    tested = is_tested(
        found[0].posterior.case.records,
        deformation=asked.deformation,
        temperature=asked.temperature,
        sense=sign * SENSE[asked.direction],
    )
    above = None
    if asked.limit_force is not None:
        above = members.above(asked.limit_force - half)
    levels = []
    for row, warm in enumerate(asked.temperature):
        ends = sorted((sign * float(low[row]), sign * float(high[row])))
        levels.append(
            Level(
                temperature_C=float(warm),
                tested=bool(tested[row]),
                force_N=_signed([q[row] for q in mean], sign),
                member_N=_signed([q[row] for q in member], sign),
                lower_bound_N=ends[0],
                upper_bound_N=ends[1],
                capacity_N=float(capacity[row]),
                capacity_median_N=float(least[row]),
                exceedance=None
                if above is None
                else _exceedance(above[:, row], weight, found, asked.confidence),
            )
        )
    return tuple(levels)


def _signed(quantiles: Sequence[float], sign: int) -> Interval:
    low, middle, high = (sign * float(value) for value in quantiles)
    return Interval(median=middle, lo=min(low, high), hi=max(low, high))


def _outer(level: Level | ModelBound, sign: int) -> float:
    """Return the larger bound in size, along the direction of loading [N]."""
    return level.upper_bound_N if sign > 0 else -level.lower_bound_N


def _exceedance(
    above: np.ndarray, weight: np.ndarray, found: Sequence[Model], confidence: float
) -> Exceedance:
    """Return the probability of exceedance from the share above in each draw."""
    mean = float(weight @ above)
    # Each draw counts for less where draws depend on each other.
    less = np.concatenate(
        [np.full(m.size, (m.size / m.independent_draws) ** 0.5) for m in found]
    )
    error = float(np.linalg.norm(less * weight * (above - mean)))
    independent = 1.0 / sum(m.probability**2 / m.independent_draws for m in found)
    resolved = error <= _ROUGH * mean and mean >= RAREST
    if not resolved and error > _ROUGH * mean:
        mean = min(mean + _UNSEEN / independent, 1.0)
    elif not resolved:
        mean = RAREST
    low, high, sure = over_draws(
        above[:, None], weight, [_TAILS[0], _TAILS[2], confidence]
    )[:, 0]
    return Exceedance(
        probability=mean,
        error=error,
        resolved=resolved,
        lo=float(low),
        hi=float(high),
        at_confidence=float(sure),
        beta=float(-ndtri(np.clip(mean, 1e-300, 1.0 - 1e-16))),
    )


def _decision(asked: MarginRequest, worst: Level, estimate: float, step: float):
    if asked.limit_force is None or worst.exceedance is None:
        return None
    sign, span = asked.direction_of_loading, worst.member_N
    low, high = sorted((sign * span.lo, sign * span.hi))
    # The rounding is a component of the interval: it is in the limit only once.
    numbers = asked.limit_force, sign * estimate, low, high
    return decide(asked.rule, *numbers, worst.exceedance.probability)


def _each_model(
    found: Sequence[Model], parts: Sequence[Members], asked: MarginRequest, step: float
) -> tuple[ModelBound, ...]:
    """Return the bounds of each of several models; of one none."""
    sign, bounds = asked.direction_of_loading, []
    if len(found) == 1:
        return ()
    for model, part in zip(found, parts, strict=True):
        shares = ((1.0 - asked.content, 1.0 - asked.confidence, -0.5),)
        shares += ((asked.content, asked.confidence, 0.5),)
        ends = sorted(
            sign
            * (float(over_draws(part.quantile(p), part.weight, [g])[0, 0]) + s * step)
            for p, g, s in shares
        )
        bounds.append(
            ModelBound(
                model=model.name,
                probability=model.probability,
                lower_bound_N=ends[0],
                upper_bound_N=ends[1],
            )
        )
    return tuple(bounds)


def _data(model: Model) -> CalibrationSource:
    case = model.posterior.case
    return CalibrationSource(
        gear=case.gear.name,
        theory=model.posterior.theory,
        name=case.name,
        rows=len(case.records.force),
        sha256=case.data_sha256,
    )
