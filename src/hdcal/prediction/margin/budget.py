"""The uncertainty budget of one future member's force, from the model's own draws.

Inputs that the data tie to each other are made independent, in an order: first those
of which the data say nothing (certificates, the material's loss of modulus, the
gauge's zero), each with all that depends on it, then what the fit leaves. The variance
stays what it was, and no share has to be negative.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from hdcal.exported import jit
from hdcal.physics.effect import parameters
from hdcal.prediction.budget.inputs import (
    InputGroup,
    independent,
    joined_inputs,
    limited_input,
    one_input,
    scatter_law,
)
from hdcal.prediction.budget.linear import effective_dof, linear_budget
from hdcal.prediction.engine.causes import Cause, Driver, independent_draws
from hdcal.prediction.engine.population import new_member_sd
from hdcal.prediction.engine.population_force import PopulationForce, member_force
from hdcal.prediction.margin.force_model import DRIFTS, ForceModel

# Sites of a draw that a certificate states, where the calibration has them.
CERTIFIED = ("force_gain", "deformation_gain", "temperature_offset")
# Sites that are inputs of their own where the data say nothing of them.
_BY_PRIOR = ("alpha", "force_offset")
_BASE = ("stiffness", "deformation_offset", "alpha", "force_offset")
# Correlations up to so many standard errors are what draws show by chance.
_CHANCE = 4.0
# Correlations that are none by chance, however few the draws.
_CLEAR = 0.5
# A component with less of the variance than this has no row.
_LEAST_SHARE = 1e-9


@dataclass(frozen=True)
class Component:
    """What one source brings to the variance.

    Attributes:
        name: of the source.
        driven_by: data, prior, or given by whoever asked.
        law: its distribution in words.
        standard_uncertainty: in its own unit, of the code.
        sensitivity: derivative of the force by it [N per unit].
        variance: what it brings [N²].
        dof: degrees of freedom.
    """

    name: str
    driven_by: Driver
    law: str
    standard_uncertainty: float
    sensitivity: float
    variance: float
    dof: float


@dataclass(frozen=True)
class ForceBudget:
    """The linear budget of a force.

    Attributes:
        estimate: of the force [N].
        components: none without a part in the variance.
        dof: effective degrees of freedom.
    """

    estimate: float
    components: tuple[Component, ...]
    dof: float

    @property
    def variance(self) -> float:
        """Combined variance [N²]."""
        return sum(component.variance for component in self.components)


@jit
def _scatter(problem, values, whose, conditions):
    """Return variance of the noise, mean and sd of the bend, of every draw [N², N]."""
    at = jnp.reshape(jnp.asarray(conditions.deformation, float), 1)

    def one(value):
        _, (log_weight, sd) = member_force(
            problem, value, whose.quantity, conditions, 1.0
        )
        mean, width, share = conditions.untested.bends(value).law(at)
        noise = jnp.sum(jnp.exp(log_weight) * sd**2)
        return noise, (share * mean)[0], (share * width)[0]

    return jax.vmap(one)(values)


def force_budget(force: PopulationForce) -> ForceBudget:
    """Return the linear budget of one future member's force under one cause."""
    cause = force.cause
    sites, own = _sites(force)
    noise, bend, width = map(np.asarray, _scatter(*force.traced))
    scale, dof = scatter_law(noise)
    # Fit and noise have the same unknown variance of a reading; a load has no noise.
    _, dof = scatter_law(noise if scale > 0.0 else cause.values["sigma"] ** 2)
    shrunk = (dof - 2.0) / dof if np.isfinite(dof) else 1.0
    columns = [cause.values[site].reshape(cause.size, -1) for site in sites]
    sizes = [column.shape[1] for column in columns]
    draws = np.concatenate(columns, axis=1)
    blocks = [*sizes[:own], sum(sizes[own:])]
    covariance = np.atleast_2d(np.cov(draws, rowvar=False))
    # A site of which the data say nothing hangs together with others or not at all:
    # what so many independent draws would show by chance is no tie.
    chance = min(_CHANCE / np.sqrt(independent_draws(cause)), _CLEAR)
    depend, parts = independent(covariance, blocks, chance)
    groups = [
        one_input(site, 0.0, float(np.sqrt(max(part[0, 0], 0.0))))
        for site, part in zip(sites[:own], parts, strict=False)
    ]
    fit = np.zeros((blocks[-1] + 1,) * 2)
    fit[:-1, :-1], fit[-1, -1] = shrunk * parts[-1], scale**2
    groups.append(
        joined_inputs(
            ["calibration"] * blocks[-1] + ["noise"], np.zeros(len(fit)), fit, dof
        )
    )
    groups += _others(force, bend, width)
    names = tuple(name for group in groups for name in group.names)
    model = ForceModel(
        problem=cause.problem,
        values={name: column.mean(axis=0) for name, column in cause.values.items()},
        whose=force.whose,
        conditions=force.conditions,
        nominal=cause.posterior.case.gear.geometry,
        depend=depend,
        sites=tuple(sites),
        names=names[len(draws[0]) :],
        theory=cause.posterior.theory,
    )
    return _budget(model, groups, cause)


def _sites(force: PopulationForce) -> tuple[list[str], int]:
    """Return the sites that the mean force hangs on, and how many stand for themselves.

    Those come first. On a reading of the same rig gains have no part: what they bring
    the stiffness takes back.
    """
    cause = force.cause
    stated = [site for site in CERTIFIED if site in cause.values]
    of_load = force.whose.quantity == "load"
    own = [site for site in _BY_PRIOR if cause.driver(site) == "prior"]
    sites = [site for site in _BASE if site not in own]
    if of_load:
        own = stated + own
    else:
        sites += stated
    for effect in cause.problem.effects:
        sites += [f"{effect.name}.{field}" for field in parameters(effect)]
    sites += ["gap_weights"] * ("gap_weights" in cause.values)
    return own + sites, len(own)


def _others(force: PopulationForce, bend, width) -> list[InputGroup]:
    """Return the inputs that are no part of the fit."""
    cause, problem, whose = force.cause, force.cause.problem, force.whose
    groups, values, there = [], cause.values, force.conditions
    if whose.rounded:
        half = 0.5 * float(problem.step)
        groups.append(limited_input("resolution", -half, half))
    if count := whose.tested_mountings(problem):
        spread = new_member_sd(values["run_offset_sd"], count)
        groups.append(one_input("mounting", 0.0, *scatter_law(spread**2)))
    if count := whose.tested_gears(problem):
        spread = new_member_sd(values["specimen_sd"], count)
        groups.append(one_input("gear", 0.0, *scatter_law(spread**2)))
    groups += [limited_input(n, -by, by) for n, by in sorted(force.tolerances.items())]
    if not there.low <= there.deformation <= there.high:
        variance = width**2 + np.var(bend)
        mean, (scale, dof) = float(bend.mean()), scatter_law(variance)
        groups.append(one_input("leftover", mean, scale, dof))
    untested = there.untested
    if whose.quantity == "reading" and float(untested.kelvins(there.temperature)):
        drifts = {name: getattr(untested, field)[1] for name, field in DRIFTS.items()}
        groups += [one_input(n, 0.0, sd) for n, sd in drifts.items() if sd > 0.0]
    return groups


def _budget(
    model: ForceModel, groups: Sequence[InputGroup], cause: Cause
) -> ForceBudget:
    """Return the budget with one component for each name of an input."""
    found = linear_budget(model, groups)
    laws = {name: group.label for group in groups for name in group.names}
    dofs = {name: group.dof for group in groups for name in group.names}
    drivers = _drivers(cause)
    components = []
    for name in dict.fromkeys(found.names):
        rows = [i for i, other in enumerate(found.names) if other == name]
        variance = float(found.variances[rows].sum())
        if not variance > _LEAST_SHARE * found.variances.sum():
            continue
        # Inputs that are tied together are one: the force that they give.
        tied = name == "calibration"
        sd = np.sqrt(variance) if tied else found.standard_uncertainties[rows[0]]
        slope = 1.0 if tied else found.sensitivities[rows[0]]
        about = laws[name], float(sd), float(slope), variance, dofs[name]
        components.append(Component(name, drivers.get(name, "prior"), *about))
    return ForceBudget(found.estimate, tuple(components), found.dof)


def _drivers(cause: Cause) -> Mapping[str, Driver]:
    """Return what drives each component; the prior where nothing is said."""
    sites = {"noise": "sigma", "mounting": "run_offset_sd", "gear": "specimen_sd"}
    given = ("wall_thickness", "radius", "length", "load_height")
    return {
        **{name: cause.driver(site) for name, site in sites.items()},
        **dict.fromkeys(given, "given"),
        "calibration": "data",
        "cause": "data",
    }


def averaged_budget(forces: Sequence[PopulationForce]) -> ForceBudget:
    """Return the linear budget over all causes: their mean, and the spread between."""
    budgets = [force_budget(force) for force in forces]
    if len(budgets) == 1:
        return budgets[0]
    chances = np.array([force.cause.probability for force in forces])
    each = np.array([budget.estimate for budget in budgets])
    centre = float(chances @ each)
    named: dict[str, list[tuple[float, Component]]] = {}
    for chance, budget in zip(chances, budgets, strict=True):
        for part in budget.components:
            named.setdefault(part.name, []).append((chance, part))
    parts = [_mean_component(found) for found in named.values()]
    between = float(chances @ (each - centre) ** 2)
    about = "discrete", float(np.sqrt(between)), 1.0, between, np.inf
    parts.append(Component("cause", "data", *about))
    return ForceBudget(centre, tuple(parts), _joined_dof(parts))


def _joined_dof(parts: Sequence[Component]) -> float:
    """Return the effective degrees of freedom of components.

    Fit and noise have the same unknown variance of a reading: they are one.
    """
    alike = [part for part in parts if part.name in ("calibration", "noise")]
    each = [(p.variance, p.dof) for p in parts if p not in alike]
    if whole := sum(part.variance for part in alike):
        uncertain = sum(part.variance / part.dof for part in alike)
        each.append((whole, whole / uncertain if uncertain > 0.0 else np.inf))
    variances, dofs = np.array(each).T
    return effective_dof(variances, dofs)


def _mean_component(found: Sequence[tuple[float, Component]]) -> Component:
    """Return a component averaged over the causes, each with its probability."""
    chances = np.array([chance for chance, _ in found])
    parts = [part for _, part in found]
    variances, squares, dofs, slopes = (
        np.array(column)
        for column in zip(
            *[
                (p.variance, p.standard_uncertainty**2, p.dof, p.sensitivity)
                for p in parts
            ],
            strict=True,
        )
    )
    variance, square = float(chances @ variances), float(chances @ squares)
    sd = float(np.sqrt(square / chances.sum()))
    slope = np.sign(chances @ slopes) * np.sqrt(variance) / sd
    uncertain = float(chances @ (variances / dofs))
    return replace(
        parts[int(np.argmax(chances))],
        standard_uncertainty=sd,
        sensitivity=float(slope),
        variance=variance,
        dof=variance / uncertain if uncertain > 0.0 else np.inf,
    )
