"""The NumPyro model: the force model with any set of effects.

Sites whose names begin with "_" are coordinates of the sampler, not results. In each
of them the stated prior is exact.
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
SLACK = "seating_slack.clearance"


def declare(problem: Problem) -> None:
    """Declare the joint density of parameters and data of the force model."""
    priors, values = problem.priors, sample_stiffness(problem.priors)
    values["alpha"] = sample_site("alpha", priors["alpha"])
    values["force_offset"] = _sample_zero(problem, values)
    with_slack = SLACK in priors
    if not with_slack:
        values[CONTACT] = sample_site(CONTACT, priors[CONTACT])
    _sample_noise(problem, values)
    for effect in problem.effects:
        if effect.stage != "noise":
            _sample_effect(problem, effect, values)
    if with_slack:
        values[CONTACT] = _sample_contact(problem, values)
    _sample_members(problem, values)
    numpyro.deterministic("stiffness", stiffness(problem, values))
    numpyro.factor("force", log_likelihood(problem, values))


def sample_site(name: str, prior: Prior):
    """Sample a parameter from its prior; a fixed one is a constant."""
    if prior.family == "fixed":
        return numpyro.deterministic(name, jnp.asarray(prior.numbers[0]))
    return numpyro.sample(name, distribution(prior, name))


def sample_moved(
    name: str,
    prior: Prior,
    coordinate: str,
    scale: Scalar = 1.0,
    shift: Scalar = 0.0,
):
    """Sample scale · parameter + shift as a coordinate, and return the parameter."""
    if prior.family == "fixed":
        return sample_site(name, prior)
    moved = numpyro.sample(coordinate, _scaled_and_moved(name, prior, scale, shift))
    return numpyro.deterministic(name, (moved - shift) / scale)


def _scaled_and_moved(name: str, prior: Prior, scale, shift) -> dist.Distribution:
    """Return the distribution of scale · parameter + shift."""
    base = distribution(prior, name)
    domain = base.support or dist.constraints.real
    transform = dist.transforms.AffineTransform(shift, scale, domain=domain)
    return dist.TransformedDistribution(base, transform)


def sample_amplitude(name: str, prior: Prior, unit: Scalar | None):
    """Sample a parameter of an effect.

    A half-normal one is sampled as unit · log(1 + eᵘ) with the unit that the data
    resolve: linear where they do, and a logarithm only below that. A plain logarithm
    stretches the neighbourhood of zero, where an absent effect has its posterior. The
    logistic density of u is divided out.

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
    """Sample E₀, what certificates state of the gauges, and K.

    The readings identify K·E₀ times the gauges' gains only, so that product is the
    coordinate.
    """
    names = ["E0", *(name for name in GAUGE_UNITS if name in priors)]
    values = {name: sample_site(name, priors[name]) for name in names}
    modulus = with_gains(values, values["E0"])
    values["K"] = sample_moved("K", priors["K"], "_KE0", modulus)
    return values


def _sample_zero(problem: Problem, values: Mapping):
    """Sample the zero of the force, by the force at the centre of distant readings.

    Along the ridge of zero and stiffness the force at the centre stays. The ridge is
    straight in it, and curved in the zero and the logarithm of the stiffness.
    """
    name, prior = "force_offset", problem.priors["force_offset"]
    if not problem.far:
        return sample_site(name, prior)
    there = stiffness(problem, values) * problem.centre
    return sample_moved(name, prior, "_centre_force", shift=there)


def _sample_contact(problem: Problem, values: Mapping):
    """Sample the point of first contact ω₀ with slack c, by where slack is taken up.

    Rows of a gear that is pressed show ω₀ + c well, and neither ω₀ nor c. The
    coordinate of c is curved, and so would be the narrow ridge along which they trade.
    A gear that is both pressed and pulled shows ω₀ itself.
    """
    way = jnp.sign(problem.rows.deformation)
    pressed = jnp.mean(way, where=measured(len(way), problem.count))
    taken_up = pressed * values[SLACK] / problem.reading.radial_per_read
    return sample_moved(CONTACT, problem.priors[CONTACT], "_corner", shift=taken_up)


def _sample_noise(problem: Problem, values: dict) -> None:
    """Sample the noise: its sd, the correlation of neighbours, and its growth.

    Where neighbours are highly correlated rows show what each adds to the one before,
    σ √(1 − ρ²), and neither σ nor ρ: that is the coordinate. The unit of what grows
    with the force is divided by √(1 − ρ²).
    """
    prior, unshared = problem.priors["sigma"], 1.0
    if problem.correlated:
        values[CORRELATION] = sample_site(CORRELATION, problem.priors[CORRELATION])
        unshared = jnp.sqrt(1.0 - values[CORRELATION] ** 2)
        values["sigma"] = sample_moved("sigma", prior, "_added_sd", unshared)
    else:
        values["sigma"] = sample_site("sigma", prior)
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


def _sample_members(problem: Problem, values: dict) -> None:
    """Sample runs, specimens and the discrepancy, and their scales."""
    integrated, priors = problem.integrated, problem.priors
    if problem.runs:
        name = "run_offset_sd"
        values[name] = sample_site(name, priors[name])
        if problem.zero_stated:
            _widen_zero(problem, values)
        if "run" not in integrated:
            seen = _mean_sd(problem, values, problem.runs)
            values["run_offset"] = _sample_deviations(
                "run_offset", values[name], seen, problem.runs
            )
    if problem.specimens:
        name = "specimen_sd"
        values[name] = sample_site(name, priors[name])
        if "specimen" not in integrated:
            usual = jnp.sqrt(_mean_square(problem, problem.rows.force))
            seen = _mean_sd(problem, values, problem.specimens) / usual
            values["specimen_deviation"] = _sample_deviations(
                "specimen_deviation", values[name], seen, problem.specimens
            )
    if (gap := problem.discrepancy) is not None:
        for name in ("gap_sd", "gap_length"):
            values[name] = sample_site(name, priors[name])
        if "discrepancy" not in integrated:
            score = numpyro.sample("_gap", dist.Normal(0.0, 1.0).expand([gap.size]))
            scale = gap.prior_sd(values["gap_sd"], values["gap_length"])
            values["gap_weights"] = numpyro.deterministic("gap_weights", scale * score)


def _sample_deviations(name: str, sd, seen_sd, count: int):
    """Sample how far each tested member is from the mean of the tested members.

    Partially centred: a score counts in sds that a member has given its own readings
    and those of the others, so that it is as wide where members are alike as where they
    are clearly apart. Either extreme is a funnel for the other (Papaspiliopoulos,
    Roberts and Sköld, Statistical Science 22, 2007).

    Args:
        name: of the members.
        sd: between members.
        seen_sd: about how well its own readings determine a member.
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
    """Replace the prior of the gauge's zero by that of the mountings' mean zero."""
    name = "force_offset"
    gauge, both = (
        jnp.asarray(distribution(priors[name], name).log_prob(values[name]))
        for priors in (problem.priors, problem.priors_given(values))
    )
    numpyro.factor("_zero", both - gauge)
