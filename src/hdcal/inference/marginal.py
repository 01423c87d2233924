"""Runs, specimens and the discrepancy, integrated out exactly.

Given the shared parameters their scores, in prior sds, are standard normal and enter
a Gaussian likelihood linearly: in noise sds r = Z w + e. Sampling them beside their
own scale makes funnels in which a sampler can be wrong without a warning. Integrated
out, with A = I + Z'Z and u = Z'r:

    log p(r) = −½ [log|A| + r'r − u'A⁻¹u] + constant,   w = A⁻¹u + A^(−½) ξ.

Each row belongs to one run, or to one specimen, so that their block of A is diagonal:
the more numerous kind is eliminated one by one, at a cost that grows with its number,
not its cube. That its members sum to zero is one further observation without noise.
"""

import math
from collections.abc import Sequence
from functools import singledispatch
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.scipy.linalg import solve_triangular
from jaxtyping import Float, Int, Key
from scipy.linalg import helmert

from hdcal.data.records import Array
from hdcal.inference.members import MEMBER_SD, MEMBERS
from hdcal.inference.padding import measured
from hdcal.inference.problem import Problem
from hdcal.inference.sampled_problem import Sampled
from hdcal.inference.serial_correlation import log_volume, whiten
from hdcal.inference.values import (
    CORE,
    ONE,
    Values,
    block_coefficients,
    correlation_of,
    member_base,
    predict_rows,
    with_rounding,
)
from hdcal.physics.chain import linear_coefficients

_HALF_LOG_2PI = 0.5 * math.log(2.0 * math.pi)


class Grouped(eqx.Module):
    """Members of which each row has one and which sum to zero: runs, or specimens.

    Attributes:
        index: member of each block of rows [-]; blocks have the same number of rows.
        column: contribution of its member to each row [noise sds per prior sd].
        count: number of members [-].
    """

    index: Int[Array, " b"]
    column: Float[Array, " r"]
    count: int = eqx.field(static=True)

    def columns(self) -> Float[Array, "r k"]:
        """Return the contribution of each contrast between the members to each row."""
        return self.column[:, None] * self.to_rows(contrasts(self.count))

    def to_rows(self, members: Float[Array, " count ..."]) -> Float[Array, " r ..."]:
        """Return the value of its member for each row."""
        block = len(self.column) // len(self.index)
        return jnp.repeat(members[self.index], block, axis=0)

    def sums(self, rows: Float[Array, " r ..."]) -> Float[Array, " count ..."]:
        """Return the sum over the rows of each member."""
        blocks = rows.reshape(len(self.index), -1, *rows.shape[1:]).sum(axis=1)
        return jax.ops.segment_sum(blocks, self.index, self.count)


class _Solution(NamedTuple):
    """The scores given the rows.

    Attributes:
        parts: blocks of rows whose inner products are those of [Z r] without the
            members of `Grouped`: what these leave, these in prior sds, and their sum.
        factor: Cholesky factor of A.
        mean: of the scores.
        precision: of each eliminated member when the scores are known; or None.
    """

    parts: Sequence[Float[Array, "_ m1"]]
    factor: Float[Array, "m m"]
    mean: Float[Array, " m"]
    precision: Float[Array, " n"] | None


class Linear(eqx.Module):
    """A linear-Gaussian residual in noise sds; rows may be compressed.

    Attributes:
        residual: reading less its mean, shape (r,).
        design: Z, contribution of each score to the rows.
        log_scale: Σ log sd √(2π) over the measured rows.
        grouped: members besides the scores, or None.
    """

    residual: Float[Array, " r"]
    design: Float[Array, "r m"]
    log_scale: Float[Array, ""]
    grouped: Grouped | None = None

    def _solved(self) -> _Solution:
        rows = jnp.column_stack([self.design, self.residual])
        parts, precision = [rows], None
        if self.grouped is not None:
            column = self.grouped.column[:, None]
            precision = 1.0 + self.grouped.sums(column[:, 0] ** 2)
            members = self.grouped.sums(column * rows) / precision[:, None]
            total = jnp.sum(members, axis=0, keepdims=True)
            total /= jnp.sqrt(jnp.sum(1.0 / precision))
            parts = [rows - column * self.grouped.to_rows(members), members, total]
        products = sum((part.T @ part for part in parts), start=jnp.zeros(()))
        size = self.design.shape[1]
        factor = jnp.linalg.cholesky(jnp.eye(size) + products[:-1, :-1])
        half = solve_triangular(factor, products[:-1, -1], lower=True)
        mean = solve_triangular(factor.T, half, lower=False)
        return _Solution(parts, factor, mean, precision)

    def log_likelihood(self) -> Float[Array, ""]:
        """Return log p(y) with scores and members integrated out."""
        parts, factor, mean, precision = self._solved()
        # A sum of squares: the difference r'r − u'A⁻¹u would lose its digits where
        # members spread much wider than the noise.
        left = [part @ jnp.append(-mean, 1.0) for part in parts]
        square = sum((rows @ rows for rows in left), start=mean @ mean)
        volume = 2.0 * jnp.sum(jnp.log(jnp.diag(factor)))
        if precision is not None:
            volume += jnp.sum(jnp.log(precision)) + jnp.log(jnp.mean(1.0 / precision))
        return -0.5 * (square + volume) - self.log_scale

    def scores(self) -> tuple[Float[Array, " m"], Float[Array, "m m"]]:
        """Return mean of the scores given y, and a root of their covariance."""
        _, factor, mean, _ = self._solved()
        return mean, solve_triangular(factor.T, jnp.eye(len(mean)), lower=False)

    def draw(
        self, key: Key[Array, ""]
    ) -> tuple[Float[Array, " m"], Float[Array, " n"] | None]:
        """Draw scores and members, in prior sds, from their distribution given y."""
        parts, factor, mean, precision = self._solved()
        of_scores, of_members = jax.random.split(key)
        noise = jax.random.normal(of_scores, mean.shape)
        scores = mean + solve_triangular(factor.T, noise, lower=False)
        if precision is None:
            return scores, None
        noise = jax.random.normal(of_members, precision.shape)
        free = parts[1] @ jnp.append(-scores, 1.0) + noise / jnp.sqrt(precision)
        excess = jnp.sum(free) / jnp.sum(1.0 / precision) / precision
        return scores, free - excess


def contrasts(count: int) -> Float[Array, "count k"]:
    """Return an orthonormal basis of deviations that sum to zero, [count, count−1].

    Deviations from the mean of the tested members: their common part is already
    the population's centre.
    """
    return jnp.asarray(helmert(count).T)


class _Rows(NamedTuple):
    """Rows in noise sds, measured or compressed.

    Attributes:
        labels: rows or blocks of rows, with the index of each one's members.
        residual: shape (r,).
        columns: what a member of each kind adds to its rows, per unit.
        gap: columns of the discrepancy, or None.
        log_scale: as `Linear` has it.
    """

    labels: Any
    residual: Float[Array, " r"]
    columns: dict[str, Float[Array, " r"]]
    gap: Float[Array, "r m"] | None
    log_scale: Float[Array, ""]


def linear_part(problem: Problem, values: Values) -> Linear:
    """Return the residual that the integrated members have to explain.

    Args:
        problem: structure and data.
        values: parameters of one draw; integrated members among them do not count.
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
    correlation, before = correlation_of(values), problem.before
    following = 0 if before is None else jnp.sum(before >= 0)

    def white(column):
        """Return what a column is where the noise is independent and of sd 1."""
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
    correlation, noise = correlation_of(values), (values["sigma"], problem.step)
    blocks = problem.blocks.whitened(correlation, *noise)
    sd = jnp.sqrt(blocks.variance(*noise))
    factor = blocks.factor / sd[:, None, None]
    base = member_base(problem, {**values, "force_offset": 0.0})
    slope = linear_coefficients(base, problem.reading)
    coefficients = block_coefficients(problem, blocks, values)
    fitted = jnp.einsum("gij,gj->gi", factor[..., :-1], coefficients)
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
    """Return mean and root of the covariance of the discrepancy's integrated weights.

    Args:
        problem: structure.
        values: shared parameters of one draw.
    """
    mean, root = linear_part(problem, values).scores()
    scale = _gap_sd(problem, values)
    return scale * mean[-len(scale) :], scale[:, None] * root[-len(scale) :]


@singledispatch
def draw_members(problem: Sampled, values: Values, key: Key[Array, ""]) -> dict:
    """Draw the integrated members given the shared parameters of one draw."""
    return {}


@draw_members.register
def _(problem: Problem, values: Values, key: Key[Array, ""]) -> dict:
    if not problem.integrated:
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
