"""Runs, specimens and the discrepancy, integrated out exactly.

Given the shared parameters they are normal a priori and enter a Gaussian likelihood
linearly. Sampled together with their scale they make funnels, in which a sampler can be
wrong without a warning. Of runs and specimens the more numerous kind is eliminated one
by one.
"""

import math
from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Float, Key

from hdcal.data.records import Array
from hdcal.inference.linear_gaussian import Grouped, Linear, contrasts
from hdcal.inference.members import MEMBER_SD, MEMBERS
from hdcal.inference.padding import measured
from hdcal.inference.problem import Problem
from hdcal.inference.sampled_problem import Sampled
from hdcal.inference.serial_correlation import CORRELATION, log_volume, whiten
from hdcal.inference.values import (
    Values,
    member_base,
    predict_rows,
    with_rounding,
)
from hdcal.physics.chain import linear_coefficients

# Columns of the linear core: deformation, deformation × ΔT, one, ΔT.
CORE, ONE = 4, 2
_HALF_LOG_2PI = 0.5 * math.log(2.0 * math.pi)


class _Rows(NamedTuple):
    """Rows in noise sds, measured or compressed.

    Attributes:
        labels: rows or blocks of rows, with the indices of their members.
        residual: reading less mean, shape (r,).
        columns: contribution of a unit member of each kind to its rows.
        gap: columns of the discrepancy, or None.
        log_scale: Σ log sd √(2π) over the measured rows.
    """

    labels: Any
    residual: Float[Array, " r"]
    columns: dict[str, Float[Array, " r"]]
    gap: Float[Array, "r m"] | None
    log_scale: Float[Array, ""]


def linear_part(problem: Problem, values: Values) -> Linear:
    """Return the residual that the integrated members have to explain.

    Values of integrated members, if there are any, are left out.
    """
    drawn = {MEMBERS[kind] for kind in problem.integrated}
    values = {name: value for name, value in values.items() if name not in drawn}
    prepare = _measured_rows if problem.blocks is None else _compressed_rows
    rows = prepare(problem, values)
    groups = [
        Grouped(
            getattr(rows.labels, kind),
            values[MEMBER_SD[kind]] * rows.columns[kind],
            getattr(problem, f"{kind}s"),
        )
        for kind in _labelled(problem)
    ]
    design = [jnp.zeros((len(rows.residual), 0)), *(g.columns() for g in groups[1:])]
    if "discrepancy" in problem.integrated:
        assert rows.gap is not None
        design.append(rows.gap * _gap_sd(problem, values))
    eliminated = groups[0] if groups else None
    return Linear(rows.residual, jnp.hstack(design), rows.log_scale, eliminated)


def _labelled(problem: Problem) -> list[str]:
    """Return the integrated kinds that are labels in the data, most members first."""
    return [kind for kind in problem.integrated if kind in MEMBER_SD]


def _gap_sd(problem: Problem, values: Values) -> Float[Array, " m"]:
    assert problem.discrepancy is not None
    return problem.discrepancy.prior_sd(values["gap_sd"], values["gap_length"])


def _measured_rows(problem: Problem, values: Values) -> _Rows:
    mean, noise = predict_rows(problem, values, problem.rows, None)
    sd = with_rounding(noise, problem.step).sd[0]
    real = measured(len(sd), problem.count)
    correlation, before = values.get(CORRELATION, 0.0), problem.before
    following = 0 if before is None else jnp.sum(before >= 0)

    def white(column):
        """Return a column where the noise is independent and of sd 1."""
        scaled = (jnp.where(real, 1.0 / sd, 0.0) * column.T).T
        return scaled if before is None else whiten(scaled, before, correlation)

    volume = jnp.sum(jnp.where(real, jnp.log(sd) + _HALF_LOG_2PI, 0.0))
    return _Rows(
        problem.rows,
        white(problem.rows.force - mean),
        {"run": white(jnp.ones_like(sd))},
        None if problem.columns is None else white(problem.columns),
        volume + log_volume(following, correlation),
    )


def _compressed_rows(problem: Problem, values: Values) -> _Rows:
    assert problem.blocks is not None
    correlation, noise = values.get(CORRELATION, 0.0), (values["sigma"], problem.step)
    blocks = problem.blocks.whitened(correlation, *noise)
    sd = jnp.sqrt(blocks.variance(*noise))
    factor = blocks.factor / sd[:, None, None]
    base = member_base(problem, {**values, "force_offset": 0.0})
    slope = linear_coefficients(base, problem.reading)
    of_blocks = member_base(problem, values, blocks.run, blocks.specimen)
    core = linear_coefficients(of_blocks, problem.reading)
    core = jnp.broadcast_to(core, (len(blocks.count), CORE))
    fitted = jnp.einsum("gij,gj->gi", factor[..., :CORE], core)
    volume = jnp.sum(blocks.count * (jnp.log(sd) + _HALF_LOG_2PI))
    return _Rows(
        blocks,
        (factor[..., -1] - fitted).reshape(-1),
        {
            "run": factor[..., ONE].reshape(-1),
            "specimen": (factor[..., :CORE] @ slope).reshape(-1),
        },
        factor[..., CORE:-1].reshape(fitted.size, -1),
        volume + log_volume(jnp.sum(blocks.following), correlation),
    )


def gap_distribution(
    problem: Problem, values: Values
) -> tuple[Float[Array, " m"], Float[Array, "m k"]]:
    """Return mean and covariance root of the discrepancy's integrated weights."""
    mean, root = linear_part(problem, values).scores()
    scale = _gap_sd(problem, values)
    return scale * mean[-len(scale) :], scale[:, None] * root[-len(scale) :]


def draw_members(problem: Sampled, values: Values, key: Key[Array, ""]) -> dict:
    """Draw the integrated members, if any, given the shared parameters of one draw."""
    if not isinstance(problem, Problem) or not problem.integrated:
        return {}
    scores, members = linear_part(problem, values).draw(key)
    drawn, used = {}, 0
    for place, kind in enumerate(_labelled(problem)):
        if place > 0:
            count = getattr(problem, f"{kind}s")
            members = contrasts(count) @ scores[used : used + count - 1]
            used += count - 1
        drawn[MEMBERS[kind]] = values[MEMBER_SD[kind]] * members
    if "discrepancy" in problem.integrated:
        drawn["gap_weights"] = _gap_sd(problem, values) * scores[used:]
    return drawn
