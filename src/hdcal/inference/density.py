"""The likelihood of a problem's data, whatever form they are kept in."""

from collections.abc import Mapping
from functools import singledispatch
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Key

from hdcal.data.records import Array, Records
from hdcal.inference import compress
from hdcal.inference.discrepancy import BASIS_SIZE, prior_sd
from hdcal.inference.distributions import distribution
from hdcal.inference.likelihood import log_probability
from hdcal.inference.member_offsets import Linear, contrasts
from hdcal.inference.padding import measured
from hdcal.inference.problem import Problem
from hdcal.inference.sampled_problem import Sampled
from hdcal.physics.chain import (
    Base,
    linear_coefficients,
    predict_reading,
)
from hdcal.physics.effect import Effect, Noise, parameters

# Float scalars and arrays by site name; what each one is depends on the name.
Values = Mapping[str, Any]

# A normal prior of these is cut at zero.
POSITIVE = frozenset({"E0", "mass", "damping_ratio", "deformation_sigma"})
MEMBERS = {
    "run": "run_offset",
    "specimen": "specimen_deviation",
    "discrepancy": "gap_weights",
}
# The site of the spread of those that are labels in the data.
MEMBER_SD = {"run": "run_offset_sd", "specimen": "specimen_sd"}
# Columns of the linear core: deformation, deformation × ΔT, one, ΔT.
_CORE, _ONE = 4, 2


def stiffness(problem: Problem, values: Values) -> Float[Array, ""]:
    """Return K·k_theory at T_ref, per mm as read [N/mm]."""
    radial = values["K"] * values["E0"] * problem.unit_stiffness
    return radial * problem.reading.radial_per_read


def member_base(problem: Problem, values: Values, run=None, specimen=None) -> Base:
    """Return the base parameters of given runs and specimens.

    Deviations that are not among the values (integrated out) count as zero.

    Args:
        problem: structure.
        values: parameters of one draw.
        run: run indices, or None for the mean of the tested runs.
        specimen: specimen indices, or None likewise.
    """
    scale, offset = values["K"] * values["E0"] * problem.unit_stiffness, 0.0
    if specimen is not None and "specimen_deviation" in values:
        scale = scale * (1.0 + values["specimen_deviation"][specimen])
    if run is not None and "run_offset" in values:
        offset = values["run_offset"][run]
    return Base(
        stiffness=scale,
        alpha=values["alpha"],
        deformation_offset=values["deformation_offset"],
        force_offset=values["force_offset"] + offset,
        sigma=values["sigma"],
    )


def build_effects(problem: Problem, values: Values) -> tuple[Effect, ...]:
    """Return the effects of the problem with the parameters of one draw."""
    return tuple(
        effect(**{name: values[f"{effect.name}.{name}"] for name in parameters(effect)})
        for effect in problem.effects
    )


def predict_rows(
    problem: Problem, values: Values, records: Records, columns
) -> tuple[Float[Array, " n"], Noise]:
    """Return mean reading [N] and noise of rows of the tested runs and specimens.

    Args:
        problem: structure.
        values: parameters of one draw.
        records: the rows.
        columns: basis of the discrepancy at the rows, or None.
    """
    base = member_base(problem, values, records.run, records.specimen)
    mean, noise = predict_reading(
        base, build_effects(problem, values), records, problem.reading
    )
    if "gap_weights" in values:
        mean = mean + columns @ values["gap_weights"]
    return mean, noise


def _with_rounding(noise: Noise, step) -> Noise:
    """Add Sheppard's variance of the rounding to the noise."""
    return Noise(noise.log_weight, jnp.sqrt(noise.sd**2 + step**2 / 12.0))


def pointwise_log_likelihood(
    problem: Problem, values: Values, records: Records, columns
) -> Float[Array, " n"]:
    """Return the log likelihood of each row given all values [log 1/N]."""
    mean, noise = predict_rows(problem, values, records, columns)
    if not problem.rounded:
        noise = _with_rounding(noise, problem.step)
    return log_probability(
        records.force, mean, noise, problem.step, rounded=problem.rounded
    )


@singledispatch
def log_likelihood(problem: Sampled, values: Values) -> Float[Array, ""]:
    """Return the log likelihood of all data, members integrated out where they can.

    Padding counts for nothing.
    """
    raise NotImplementedError(type(problem).__name__)


@log_likelihood.register
def _(problem: Problem, values: Values) -> Float[Array, ""]:
    if problem.integrated:
        return linear_part(problem, values).log_likelihood()
    if problem.blocks is not None:
        coefficients = _block_coefficients(problem, problem.blocks, values)
        return compress.log_likelihood(
            problem.blocks, coefficients, values["sigma"], problem.step
        )
    rows, columns = problem.rows, problem.columns
    each = pointwise_log_likelihood(problem, values, rows, columns)
    return jnp.sum(jnp.where(measured(len(each), problem.count), each, 0.0))


def linear_part(problem: Problem, values: Values) -> Linear:
    """Return the residual that the integrated members have to explain.

    Members already drawn are left out: they are what is integrated over.
    """
    drawn = {MEMBERS[kind] for kind in problem.integrated}
    values = {name: value for name, value in values.items() if name not in drawn}
    scale = []
    if "run" in problem.integrated:
        scale.append(jnp.full(problem.runs - 1, values["run_offset_sd"]))
    if "specimen" in problem.integrated:
        scale.append(jnp.full(problem.specimens - 1, values["specimen_sd"]))
    if "discrepancy" in problem.integrated:
        scale.append(prior_sd(values["gap_sd"], values["gap_length"]))
    if problem.blocks is not None:
        return _linear_blocks(problem, problem.blocks, values, jnp.concatenate(scale))
    return _linear_rows(problem, values, jnp.concatenate(scale))


def _linear_rows(problem: Problem, values: Values, scale) -> Linear:
    records = problem.rows
    mean, noise = predict_rows(problem, values, records, None)
    sd = _with_rounding(noise, problem.step).sd[0]
    design = []
    if "run" in problem.integrated:
        design.append(contrasts(problem.runs)[records.run])
    if "discrepancy" in problem.integrated:
        design.append(problem.columns)
    real = measured(len(sd), problem.count)
    return Linear(
        residual=jnp.where(real, records.force - mean, 0.0),
        design=jnp.where(real[:, None], jnp.concatenate(design, axis=1), 0.0),
        sd=sd,
        scale=scale,
        log_volume=jnp.sum(jnp.where(real, jnp.log(sd), 0.0)),
        count=problem.count,
    )


def _linear_blocks(
    problem: Problem, blocks: compress.CompressedRows, values: Values, scale
) -> Linear:
    groups, width = blocks.factor.shape[:2]
    design = []  # each [group, column of X, weight]
    if "run" in problem.integrated:
        rows = contrasts(problem.runs)[blocks.run]
        unit = jnp.zeros(width - 1).at[_ONE].set(1.0)
        design.append(unit[None, :, None] * rows[:, None, :])
    if "specimen" in problem.integrated:
        rows = contrasts(problem.specimens)[blocks.specimen]
        base = member_base(problem, {**values, "force_offset": 0.0})
        slope = jnp.zeros(width - 1)
        slope = slope.at[:_CORE].set(linear_coefficients(base, problem.reading))
        design.append(slope[None, :, None] * rows[:, None, :])
    if "discrepancy" in problem.integrated:
        basis = jnp.eye(width - 1)[:, _CORE:]
        design.append(jnp.broadcast_to(basis, (groups, *basis.shape)))
    variance = values["sigma"] ** 2 + blocks.known_sd**2 + problem.step**2 / 12.0
    mapped = jnp.einsum(
        "gij,gjk->gik", blocks.factor[..., :-1], jnp.concatenate(design, axis=-1)
    )
    residual = compress.residual(blocks, _block_coefficients(problem, blocks, values))
    return Linear(
        residual=residual.reshape(-1),
        design=mapped.reshape(groups * width, -1),
        sd=jnp.repeat(jnp.sqrt(variance), width),
        scale=scale,
        log_volume=0.5 * jnp.sum(blocks.count * jnp.log(variance)),
        count=jnp.sum(blocks.count),
    )


def _block_coefficients(
    problem: Problem, blocks: compress.CompressedRows, values: Values
) -> Float[Array, "g p"]:
    """Return the coefficients of each block, those of the discrepancy zero."""
    base = member_base(problem, values, blocks.run, blocks.specimen)
    core = linear_coefficients(base, problem.reading)
    core = jnp.broadcast_to(core, (len(blocks.count), _CORE))
    width = blocks.factor.shape[-1] - 1
    return jnp.pad(core, ((0, 0), (0, width - _CORE)))


@singledispatch
def draw_members(problem: Sampled, values: Values, key: Key[Array, ""]) -> dict:
    """Draw the integrated members given the shared parameters of one draw."""
    return {}


@draw_members.register
def _(problem: Problem, values: Values, key: Key[Array, ""]) -> dict:
    if not problem.integrated:
        return {}
    weights = linear_part(problem, values).draw(key)
    drawn, used = {}, 0
    if "run" in problem.integrated:
        used = problem.runs - 1
        drawn["run_offset"] = contrasts(problem.runs) @ weights[:used]
    if "specimen" in problem.integrated:
        own = weights[used : used + problem.specimens - 1]
        drawn["specimen_deviation"] = contrasts(problem.specimens) @ own
    if "discrepancy" in problem.integrated:
        drawn["gap_weights"] = weights[-BASIS_SIZE:]
    return drawn


def log_prior(problem: Sampled, values: Values) -> Float[Array, ""]:
    """Return the log prior of the named parameters, each in its own coordinate."""
    total = jnp.zeros(())
    for name, prior in problem.priors.items():
        if name in values and prior.family != "fixed":
            law = distribution(prior, positive=name in POSITIVE)
            total = total + law.log_prob(values[name])
    return total


def densities(problem: Sampled, draws: Values) -> tuple[np.ndarray, np.ndarray]:
    """Return log prior and log likelihood of each draw, (chain, draw) each."""
    of_prior, of_data = _densities(problem, draws)
    return np.asarray(of_prior), np.asarray(of_data)


@jax.jit
def _densities(problem: Sampled, values):
    def both(one):
        return log_prior(problem, one), log_likelihood(problem, one)

    return jax.vmap(jax.vmap(both))(values)
