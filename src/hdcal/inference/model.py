"""The NumPyro model: the force model with any set of effects.

The stiffness as read identifies K·E₀ times the gauges' gains only, so that product is
sampled, given the rest, under exactly the prior that all imply; K follows. Sites whose
names begin with "_" are coordinates of the sampler, not results.
"""

from collections.abc import Mapping

import jax.numpy as jnp
import numpyro
import numpyro.distributions as dist
from jax.nn import log_sigmoid, softplus

from hdcal.data.gear_file.certificates import GAUGE_UNITS
from hdcal.data.priors import Prior
from hdcal.inference.density import log_likelihood
from hdcal.inference.distributions import distribution
from hdcal.inference.gauges import with_gains
from hdcal.inference.padding import measured
from hdcal.inference.problem import Problem
from hdcal.inference.serial_correlation import CORRELATION
from hdcal.inference.values import stiffness
from hdcal.physics.effect import Effect, parameters
from hdcal.physics.theory import Scalar

CONTACT = "deformation_offset"


def sample_site(name: str, prior: Prior):
    """Sample a parameter from its prior; a fixed one is what it is."""
    if prior.family == "fixed":
        return numpyro.deterministic(name, jnp.asarray(prior.numbers[0]))
    return numpyro.sample(name, distribution(prior, name))


def sample_amplitude(name: str, prior: Prior, unit: Scalar | None):
    """Sample a parameter of an effect.

    A half-normal one is sampled as unit · log(1 + eᵘ) with the unit that the data
    resolve: linear where they see it, and a logarithm only below that. A plain
    logarithm stretches the neighbourhood of zero, where an absent effect has its
    posterior. The logistic density of u is taken off again, so the prior is exact.

    Args:
        name: of the parameter.
        prior: of the parameter.
        unit: of one that is half-normal.
    """
    if unit is None:
        return sample_site(name, prior)
    logistic = dist.Logistic(0.0, 1.0)
    u = numpyro.sample(f"_{name}", logistic)
    size = unit * softplus(u)
    log_jacobian = jnp.log(unit) + log_sigmoid(u)
    log_prior = distribution(prior, name).log_prob(size) + log_jacobian
    numpyro.factor(f"_{name}_prior", log_prior - logistic.log_prob(u))
    return numpyro.deterministic(name, size)


def sample_stiffness(priors: Mapping[str, Prior]) -> dict:
    """Sample E₀, what certificates state of the gauges, and K."""
    values = {"E0": sample_site("E0", priors["E0"])}
    stated = (name for name in GAUGE_UNITS if name in priors)
    values |= {name: sample_site(name, priors[name]) for name in stated}
    values["K"] = _sample_influence(priors["K"], with_gains(values, values["E0"]))
    return values


def _sample_influence(prior: Prior, modulus):
    """Sample K·E₀, as read, under the prior of K, and return K."""
    if prior.family == "fixed":
        return sample_site("K", prior)
    law = _scaled_and_moved(distribution(prior), modulus, 0.0)
    product = numpyro.sample("_KE0", law)
    return numpyro.deterministic("K", product / modulus)


def _scaled_and_moved(law, scale, shift) -> dist.Distribution:
    """Return the distribution of scale · parameter + shift."""
    domain = law.support or dist.constraints.real
    transform = dist.transforms.AffineTransform(shift, scale, domain=domain)
    return dist.TransformedDistribution(law, transform)


def _sample_contact(problem: Problem, values: Mapping):
    """Sample the point of first contact ω₀ beside slack: where that is taken up.

    Rows of a gear that is pressed show ω₀ + c well, and neither ω₀ nor the slack c. The
    coordinate of c is curved, and so would be the narrow ridge along which they trade.
    A gear that is both pressed and pulled shows ω₀ itself.
    """
    prior = problem.priors[CONTACT]
    if prior.family == "fixed":
        return sample_site(CONTACT, prior)
    pressed = jnp.mean(jnp.sign(problem.rows.deformation))
    slack = values["seating_slack.clearance"]
    taken = pressed * slack / problem.reading.radial_per_read
    law = _scaled_and_moved(distribution(prior), 1.0, taken)
    corner = numpyro.sample("_corner", law)
    return numpyro.deterministic(CONTACT, corner - taken)


def _sample_zero(problem: Problem, values: Mapping):
    """Sample the force at the centre of readings far from the origin, and its zero.

    Along the ridge of zero and stiffness the force at the centre stays. The ridge is
    straight in it, and curved in the zero beside a logarithm of the stiffness.
    """
    prior = problem.priors["force_offset"]
    if prior.family == "fixed":
        return sample_site("force_offset", prior)
    there = stiffness(problem, values) * problem.centre
    law = _scaled_and_moved(distribution(prior), 1.0, there)
    at_centre = numpyro.sample("_centre_force", law)
    return numpyro.deterministic("force_offset", at_centre - there)


def _sample_noise(problem: Problem, values: dict) -> None:
    """Sample what noise there is: its sd, how neighbours err alike, and its growth.

    Where neighbours err nearly alike rows show what each adds to the one before,
    σ √(1 − ρ²), and neither σ nor ρ. So that is sampled, and σ follows; what grows with
    the force is counted in a unit as much larger.
    """
    name, prior, unshared = "sigma", problem.priors["sigma"], 1.0
    if problem.correlated:
        values[CORRELATION] = sample_site(CORRELATION, problem.priors[CORRELATION])
        unshared = jnp.sqrt(1.0 - values[CORRELATION] ** 2)
    if problem.correlated and prior.family != "fixed":
        law = _scaled_and_moved(distribution(prior, name), unshared, 0.0)
        added = jnp.asarray(numpyro.sample("_added_sd", law))
        values[name] = numpyro.deterministic(name, added / unshared)
    else:
        values[name] = sample_site(name, prior)
    for effect in problem.effects:
        if effect.stage == "noise":
            _sample_effect(problem, effect, values, unshared)


def _sample_effect(
    problem: Problem, effect: type[Effect], values: dict, over: Scalar = 1.0
) -> None:
    """Sample the parameters of an effect, amplitudes in their unit over that."""
    for field in parameters(effect):
        name = f"{effect.name}.{field}"
        unit = problem.units.get(name)
        unit = None if unit is None else unit / over
        values[name] = sample_amplitude(name, problem.priors[name], unit)


def _sample_members(name: str, sd, seen_sd, count: int):
    """Sample how far each tested member is from the mean of the tested members.

    Partially centred: a score counts in sds that a member has given its own readings
    and those of the others, so that it is as wide where members are alike as where they
    are clearly apart. Either extreme is a funnel for the other (Papaspiliopoulos,
    Roberts and Sköld, Statistical Science 22, 2007).

    Args:
        name: of the members.
        sd: between members.
        seen_sd: about how well its own readings tell a member.
        count: of the members.
    """
    spread = jnp.sqrt(1.0 + (sd / seen_sd) ** 2)
    score = numpyro.sample(f"_{name}", dist.ZeroSumNormal(spread, (count,)))
    return numpyro.deterministic(name, sd / spread * score)


def _mean_sd(problem: Problem, values: Mapping, members: int):
    """Return about how well the mean reading of a member is known [N]."""
    known = _mean_square(problem, problem.rows.force_sd)
    variance = values["sigma"] ** 2 + known + problem.step**2 / 12.0
    return jnp.sqrt(variance * members / problem.count)


def _mean_square(problem: Problem, column):
    """Return the mean square of a column over the measured rows."""
    real = measured(len(column), problem.count)
    return jnp.sum(jnp.where(real, column**2, 0.0)) / problem.count


def _widen_zero(problem: Problem, values: dict) -> None:
    """Put the effective prior of the zero in the place of that of the gauge itself."""
    name = "force_offset"
    gauge, both = (
        jnp.asarray(distribution(priors[name], name).log_prob(values[name]))
        for priors in (problem.priors, problem.priors_given(values))
    )
    numpyro.factor("_zero", both - gauge)


def _sample_structure(problem: Problem, values: dict) -> None:
    """Sample what belongs to runs, specimens and the discrepancy, and their scales."""
    integrated, priors = problem.integrated, problem.priors
    if problem.runs:
        values["run_offset_sd"] = sample_site("run_offset_sd", priors["run_offset_sd"])
        if problem.zero_stated:
            _widen_zero(problem, values)
        if "run" not in integrated:
            sd = values["run_offset_sd"]
            seen = _mean_sd(problem, values, problem.runs)
            members = _sample_members("run_offset", sd, seen, problem.runs)
            values["run_offset"] = members
    if problem.specimens:
        values["specimen_sd"] = sample_site("specimen_sd", priors["specimen_sd"])
        if "specimen" not in integrated:
            sd, name = values["specimen_sd"], "specimen_deviation"
            usual = jnp.sqrt(_mean_square(problem, problem.rows.force))
            seen = _mean_sd(problem, values, problem.specimens) / usual
            values[name] = _sample_members(name, sd, seen, problem.specimens)
    if (gap := problem.discrepancy) is not None:
        for name in ("gap_sd", "gap_length"):
            values[name] = sample_site(name, priors[name])
        if "discrepancy" not in integrated:
            score = numpyro.sample("_gap", dist.Normal(0.0, 1.0).expand([gap.size]))
            scale = gap.prior_sd(values["gap_sd"], values["gap_length"])
            values["gap_weights"] = numpyro.deterministic("gap_weights", scale * score)


def declare(problem: Problem) -> None:
    """Declare the joint density of parameters and data of the force model."""
    priors = problem.priors
    values = sample_stiffness(priors)
    slack = any(effect.name == "seating_slack" for effect in problem.effects)
    later = {CONTACT: slack, "force_offset": problem.far}
    for name in ("alpha", "force_offset", CONTACT):
        if not later.get(name):
            values[name] = sample_site(name, priors[name])
    if problem.far:
        values["force_offset"] = _sample_zero(problem, values)
    _sample_noise(problem, values)
    for effect in problem.effects:
        if effect.stage != "noise":
            _sample_effect(problem, effect, values)
    if slack:
        values[CONTACT] = _sample_contact(problem, values)
    _sample_structure(problem, values)
    numpyro.deterministic("stiffness", stiffness(problem, values))
    numpyro.factor("force", log_likelihood(problem, values))
