"""The NumPyro model: the force model with any set of effects.

Sites whose names begin with "_" are coordinates of the sampler, not results. In each
of them the stated prior is exact.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpyro
import numpyro.distributions as dist
from jax.nn import log_sigmoid, softplus

from hdcal.data.gear_file.certificates import GAUGE_UNITS
from hdcal.data.priors import Prior
from hdcal.inference.distributions import distribution
from hdcal.inference.force_model.padding import measured
from hdcal.inference.force_model.serial_correlation import CORRELATION
from hdcal.inference.force_model.values import apply_gains, rounding_variance, stiffness
from hdcal.physics.effect import Effect, parameters
from hdcal.physics.theory import Scalar

if TYPE_CHECKING:
    from hdcal.inference.force_model.problem import Problem

CONTACT = "deformation_offset"
SLACK = "seating_slack.clearance"
# Unit of the coordinate of an amplitude, in sds of its prior.
_AMPLITUDE = 0.1


def declare(problem: "Problem") -> None:
    """Declare the joint density of parameters and data of the force model."""
    priors, values = problem.priors, sample_stiffness(problem.priors)
    values["alpha"] = sample_site("alpha", priors["alpha"])
    # The force at the centre of the readings is constant along the ridge of zero and
    # stiffness, which is curved in the zero and the logarithm of the stiffness.
    there = stiffness(problem, values) * problem.centre
    name = "force_offset"
    if problem.runs:
        values["run_offset_sd"] = sample_site("run_offset_sd", priors["run_offset_sd"])
    zero = problem.priors_given(values)[name]
    values[name] = sample_affine(name, zero, "_centre_force", shift=there)
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
    numpyro.factor("force", problem.log_likelihood(values))


def sample_site(name: str, prior: Prior):
    """Sample a parameter from its prior; a fixed one is a constant."""
    if prior.family == "fixed":
        return numpyro.deterministic(name, jnp.asarray(prior.numbers[0]))
    return numpyro.sample(name, distribution(prior, name))


def sample_affine(
    name: str,
    prior: Prior,
    coordinate: str,
    scale: Scalar = 1.0,
    shift: Scalar = 0.0,
):
    """Sample scale · parameter + shift as a coordinate, and return the parameter."""
    if prior.family == "fixed":
        return sample_site(name, prior)
    base = distribution(prior, name)
    domain = base.support or dist.constraints.real
    transform = dist.transforms.AffineTransform(shift, scale, domain=domain)
    affine = numpyro.sample(coordinate, dist.TransformedDistribution(base, transform))
    return numpyro.deterministic(name, (affine - shift) / scale)


def sample_amplitude(name: str, prior: Prior, over: Scalar = 1.0):
    """Sample a half-normal amplitude as unit · log(1 + eᵘ), with `over` in the unit.

    Linear where the data determine it, and a logarithm only far below its prior sd. A
    plain logarithm stretches the neighbourhood of zero, where an absent effect has its
    posterior. The logistic density of u is divided out.
    """
    logistic = dist.Logistic(0.0, 1.0)
    u = numpyro.sample(f"_{name}", logistic)
    unit = _AMPLITUDE * prior.numbers[0] / over
    size = unit * softplus(u)
    log_jacobian = jnp.log(unit) + log_sigmoid(u)
    log_prior = distribution(prior, name).log_prob(size) + log_jacobian
    numpyro.factor(f"_{name}_prior", log_prior - logistic.log_prob(u))
    return numpyro.deterministic(name, size)


def sample_stiffness(priors: Mapping[str, Prior]) -> dict:
    """Sample E₀, the gains and zeros that certificates state, and K.

    The readings identify only K·E₀ times the gauges' gains: that is the coordinate.
    """
    names = ["E0", *(name for name in GAUGE_UNITS if name in priors)]
    values = {name: sample_site(name, priors[name]) for name in names}
    modulus = apply_gains(values, values["E0"])
    values["K"] = sample_affine("K", priors["K"], "_KE0", modulus)
    return values


def _sample_contact(problem: "Problem", values: Mapping):
    """Sample the point of first contact ω₀ with slack c, by where slack is taken up.

    Rows of a gear that is pressed determine ω₀ + c well, and neither ω₀ nor c. Rows of
    a gear that is both pressed and pulled determine ω₀ itself.
    """
    way = jnp.sign(problem.rows.deformation - problem.contact)
    pressed = jnp.mean(way, where=measured(len(way), problem.count))
    taken_up = pressed * values[SLACK] / problem.reading.radial_per_read
    return sample_affine(CONTACT, problem.priors[CONTACT], "_corner", shift=taken_up)


def _sample_noise(problem: "Problem", values: dict) -> None:
    """Sample the noise: its sd, the correlation of neighbours, and its effects.

    Where neighbours are highly correlated, rows determine the sd of the innovations,
    σ √(1 − ρ²), but neither σ nor ρ: that sd is the coordinate. The unit of the part
    that grows with the force is divided by √(1 − ρ²).
    """
    prior, factor = problem.priors["sigma"], 1.0
    if problem.correlated:
        values[CORRELATION] = sample_site(CORRELATION, problem.priors[CORRELATION])
        factor = jnp.sqrt(1.0 - values[CORRELATION] ** 2)
        values["sigma"] = sample_affine("sigma", prior, "_added_sd", factor)
    else:
        values["sigma"] = sample_site("sigma", prior)
    for effect in problem.effects:
        if effect.stage == "noise":
            _sample_effect(problem, effect, values, factor)


def _sample_effect(
    problem: "Problem", effect: type[Effect], values: dict, over: Scalar = 1.0
) -> None:
    """Sample the parameters of an effect; `over` divides the unit of amplitudes."""
    for field in parameters(effect):
        name = f"{effect.name}.{field}"
        prior = problem.priors[name]
        if prior.family == "half_normal":
            values[name] = sample_amplitude(name, prior, over)
        else:
            values[name] = sample_site(name, prior)


def _sample_members(problem: "Problem", values: dict) -> None:
    """Sample scales of specimens and discrepancy, and members if not integrated.

    Runs and specimens are deviations from the mean of the tested ones.
    """
    integrated, priors = problem.integrated, problem.priors
    names = ["specimen_sd"] if problem.specimens else []
    names += ["gap_sd", "gap_length"] if problem.discrepancy is not None else []
    values |= {name: sample_site(name, priors[name]) for name in names}
    if problem.runs and "run" not in integrated:
        known = _mean_sd(problem, values, problem.runs)
        values["run_offset"] = _sample_deviations(
            "run_offset", values["run_offset_sd"], known, problem.runs
        )
    if problem.specimens and "specimen" not in integrated:
        usual = jnp.sqrt(_mean_square(problem, problem.rows.force))
        known = _mean_sd(problem, values, problem.specimens) / usual
        values["specimen_deviation"] = _sample_deviations(
            "specimen_deviation", values["specimen_sd"], known, problem.specimens
        )
    discrepancy = problem.discrepancy
    if discrepancy is not None and "discrepancy" not in integrated:
        normal = dist.Normal(0.0, 1.0).expand([discrepancy.size])
        score = numpyro.sample("_gap", normal)
        scale = discrepancy.prior_sd(values["gap_sd"], values["gap_length"])
        values["gap_weights"] = numpyro.deterministic("gap_weights", scale * score)


def _sample_deviations(name: str, sd, known_sd, count: int):
    """Sample deviations of tested members with this sd between members.

    Partially centred, with `known_sd` about how well the readings determine a member:
    scores are in its posterior sds, as wide where members agree as where they clearly
    differ. Either extreme is a funnel for the other (Papaspiliopoulos, Roberts and
    Sköld, Statistical Science 22, 2007).
    """
    spread = jnp.sqrt(1.0 + (sd / known_sd) ** 2)
    score = numpyro.sample(f"_{name}", dist.ZeroSumNormal(spread, (count,)))
    return numpyro.deterministic(name, sd / spread * score)


def _mean_sd(problem: "Problem", values: Mapping, members: int):
    """Return about how well the mean reading of a member is known [N]."""
    known = _mean_square(problem, problem.rows.force_sd)
    variance = values["sigma"] ** 2 + known + rounding_variance(problem.step)
    return jnp.sqrt(variance * members / problem.count)


def _mean_square(problem: "Problem", column):
    """Return the mean square of a column over the measured rows."""
    real = measured(len(column), problem.count)
    return jnp.sum(jnp.where(real, column**2, 0.0)) / problem.count
