"""The members of a problem that are integrated out, and drawn again."""

from functools import singledispatch
from typing import Any

import jax.numpy as jnp
from jaxtyping import Float, Key

from hdcal.data.records import Array
from hdcal.inference import compress
from hdcal.inference.member_offsets import Grouped, Linear, contrasts
from hdcal.inference.padding import measured
from hdcal.inference.problem import Problem
from hdcal.inference.sampled_problem import Sampled
from hdcal.inference.serial_correlation import log_volume, whiten
from hdcal.inference.values import (
    CORE,
    MEMBER_SD,
    MEMBERS,
    ONE,
    Values,
    block_coefficients,
    correlation_of,
    member_base,
    predict_rows,
    with_rounding,
)
from hdcal.physics.chain import linear_coefficients


def linear_part(problem: Problem, values: Values) -> Linear:
    """Return the residual that the integrated members have to explain.

    Members already drawn are left out: they are what is integrated over.
    """
    drawn = {MEMBERS[kind] for kind in problem.integrated}
    values = {name: value for name, value in values.items() if name not in drawn}
    if problem.blocks is not None:
        return _linear_blocks(problem, problem.blocks, values)
    return _linear_rows(problem, values)


def _labelled(problem: Problem) -> list[str]:
    """Return the integrated kinds that are labels in the data, most members first."""
    return [kind for kind in problem.integrated if kind in MEMBER_SD]


def _grouped(problem: Problem, values: Values, labels, columns) -> dict[str, Grouped]:
    """Return the integrated members of each kind, most members first.

    Args:
        problem: structure.
        values: parameters of one draw.
        labels: rows or blocks of rows, with the index of each one's members.
        columns: what a member of each kind adds to its rows [N per unit].
    """
    return {
        kind: Grouped(
            getattr(labels, kind),
            columns[kind].reshape(-1),
            values[MEMBER_SD[kind]],
            getattr(problem, f"{kind}s"),
        )
        for kind in _labelled(problem)
    }


def _linear(problem: Problem, values: Values, grouped, discrepancy, **rows) -> Linear:
    """Return a residual in which only the most numerous members stay members."""
    largest, *others = list(grouped.values()) or [None]
    design = [other.columns() for other in others]
    scale: list[Any] = [jnp.full(other.count - 1, other.sd) for other in others]
    if "discrepancy" in problem.integrated:
        design.append(discrepancy)
        assert problem.discrepancy is not None
        own = problem.discrepancy.prior_sd(values["gap_sd"], values["gap_length"])
        scale.append(own)
    return Linear(
        design=jnp.hstack([jnp.zeros((len(rows["residual"]), 0)), *design]),
        scale=jnp.concatenate([jnp.zeros(0), *scale]),
        grouped=largest,
        **rows,
    )


def _linear_rows(problem: Problem, values: Values) -> Linear:
    records = problem.rows
    mean, noise = predict_rows(problem, values, records, None)
    sd = with_rounding(noise, problem.step).sd[0]
    real = measured(len(sd), problem.count)
    correlation, before = correlation_of(values), problem.before
    following = 0 if before is None else jnp.sum(before >= 0)

    def white(column):
        """Return what a column is where the noise is independent and of sd 1."""
        scaled = jnp.where(real, 1.0 / sd, 0.0) * column.T
        return scaled.T if before is None else whiten(scaled.T, before, correlation)

    columns, discrepancy = {"run": white(jnp.ones_like(sd))}, problem.columns
    volume = jnp.sum(jnp.where(real, jnp.log(sd), 0.0))
    return _linear(
        problem,
        values,
        _grouped(problem, values, records, columns),
        None if discrepancy is None else white(discrepancy),
        residual=white(records.force - mean),
        sd=jnp.ones_like(sd),
        log_volume=volume + log_volume(following, correlation),
        count=problem.count,
    )


def _linear_blocks(
    problem: Problem, blocks: compress.CompressedRows, values: Values
) -> Linear:
    correlation = correlation_of(values)
    noise = values["sigma"], problem.step
    blocks = blocks.whitened(correlation, *noise)
    groups, width = blocks.factor.shape[:2]
    base = member_base(problem, {**values, "force_offset": 0.0})
    slope = linear_coefficients(base, problem.reading)
    columns = {
        "run": blocks.factor[..., ONE],
        "specimen": blocks.factor[..., :CORE] @ slope,
    }
    variance = blocks.variance(*noise)
    residual = compress.residual(blocks, block_coefficients(problem, blocks, values))
    return _linear(
        problem,
        values,
        _grouped(problem, values, blocks, columns),
        blocks.factor[..., CORE:-1].reshape(groups * width, -1),
        residual=residual.reshape(-1),
        sd=jnp.repeat(jnp.sqrt(variance), width),
        log_volume=0.5 * jnp.sum(blocks.count * jnp.log(variance))
        + log_volume(jnp.sum(blocks.following), correlation),
        count=jnp.sum(blocks.count),
    )


def gap_law(
    problem: Problem, values: Values
) -> tuple[Float[Array, " m"], Float[Array, "m k"]]:
    """Return mean and root of the covariance of the leftover's integrated weights.

    Args:
        problem: structure.
        values: shared parameters of one draw.
    """
    mean, root = linear_part(problem, values).law()
    used = sum(getattr(problem, f"{kind}s") - 1 for kind in _labelled(problem)[1:])
    return mean[used:], root[used:]


@singledispatch
def draw_members(problem: Sampled, values: Values, key: Key[Array, ""]) -> dict:
    """Draw the integrated members given the shared parameters of one draw."""
    return {}


@draw_members.register
def _(problem: Problem, values: Values, key: Key[Array, ""]) -> dict:
    if not problem.integrated:
        return {}
    weights, members = linear_part(problem, values).draw(key)
    drawn, used = {}, 0
    for place, kind in enumerate(_labelled(problem)):
        if place > 0:
            count = getattr(problem, f"{kind}s")
            members = contrasts(count) @ weights[used : used + count - 1]
            used += count - 1
        drawn[MEMBERS[kind]] = members
    if "discrepancy" in problem.integrated:
        drawn["gap_weights"] = weights[used:]
    return drawn
