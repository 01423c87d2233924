"""Runs, specimens and the discrepancy, integrated out exactly.

Given the shared parameters they are normal a priori and enter a Gaussian likelihood
linearly; sampled with their scale they make funnels. In noise sds the residual is
r = Z w + e with standard normal scores w. With A = I + Z'Z and u = Z'r:

    log p(r) = −½ [log|A| + r'r − u'A⁻¹u] + constant,   w = A⁻¹u + A^(−½) ξ.
"""

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.scipy.linalg import solve_triangular
from jaxtyping import Float, Int, Key
from scipy.linalg import helmert

from hdcal.data.records import Array
from hdcal.inference.force_model.padding import measured
from hdcal.inference.force_model.serial_correlation import (
    CORRELATION,
    log_volume,
    whiten,
)
from hdcal.inference.force_model.values import (
    MEMBER_SD,
    MEMBERS,
    member_base,
    predict_rows,
    rounding_variance,
    with_rounding,
)
from hdcal.inference.sampled_problem import Values
from hdcal.physics.chain import linear_coefficients

if TYPE_CHECKING:
    from hdcal.inference.force_model.problem import Problem

# Columns of the linear core: deformation, deformation × ΔT, one, ΔT.
CORE, ONE = 4, 2
_HALF_LOG_2PI = 0.5 * math.log(2.0 * math.pi)


class Linear(eqx.Module):
    """A linear-Gaussian residual in noise sds; rows may be compressed.

    `design` is Z, and `log_scale` Σ log sd √(2π) over the measured rows.
    """

    residual: Float[Array, " r"]
    design: Float[Array, "r m"]
    log_scale: Float[Array, ""]

    def _solved(self) -> tuple[Float[Array, "m m"], Float[Array, " m"]]:
        """Return the Cholesky factor of A, and the mean of the scores."""
        products = self.design.T @ self.design
        factor = jnp.linalg.cholesky(jnp.eye(len(products)) + products)
        half = solve_triangular(factor, self.design.T @ self.residual, lower=True)
        return factor, solve_triangular(factor.T, half, lower=False)

    def log_likelihood(self) -> Float[Array, ""]:
        """Return log p(y) with the scores integrated out."""
        factor, mean = self._solved()
        # A sum of squares: the difference r'r − u'A⁻¹u would lose its digits where
        # members spread much wider than the noise.
        rest = self.residual - self.design @ mean
        square = rest @ rest + mean @ mean
        log_det = 2.0 * jnp.sum(jnp.log(jnp.diag(factor)))
        return -0.5 * (square + log_det) - self.log_scale

    def draw(self, key: Key[Array, ""]) -> Float[Array, " m"]:
        """Draw the scores from their distribution given y."""
        factor, mean = self._solved()
        noise = jax.random.normal(key, mean.shape)
        return mean + solve_triangular(factor.T, noise, lower=False)


class _Rows(NamedTuple):
    """Rows in noise sds: residual, columns of unit members by kind, and log scale.

    Runs and specimens are given as one column and the label of each row.
    """

    residual: Float[Array, " r"]
    columns: dict[str, tuple[Float[Array, " r"], Int[Array, " r"]]]
    discrepancy: Float[Array, "r m"] | None
    log_scale: Float[Array, ""]


def linear_part(problem: "Problem", values: Values) -> Linear:
    """Return the residual that the integrated members have to explain.

    Values of integrated members, if there are any, are left out.
    """
    drawn = {MEMBERS[kind] for kind in problem.integrated}
    values = {name: value for name, value in values.items() if name not in drawn}
    prepare = _measured_rows if problem.blocks is None else _compressed_rows
    rows = prepare(problem, values)
    design: list[Any] = [jnp.zeros((len(rows.residual), 0))]
    for kind in problem.integrated:
        root = _root(problem, values, kind)
        if kind == "discrepancy":
            assert rows.discrepancy is not None
            design.append(rows.discrepancy @ root)
        else:
            column, label = rows.columns[kind]
            design.append(column[:, None] * root[label])
    return Linear(rows.residual, jnp.hstack(design), rows.log_scale)


def _root(problem: "Problem", values: Values, kind: str) -> Float[Array, "members m"]:
    """Return a root of the prior covariance of the members of a kind.

    Runs and specimens are deviations from the mean of the tested ones.
    """
    if kind != "discrepancy":
        count = {"run": problem.runs, "specimen": problem.specimens}[kind]
        return values[MEMBER_SD[kind]] * contrasts(count)
    assert problem.discrepancy is not None
    sd = problem.discrepancy.prior_sd(values["gap_sd"], values["gap_length"])
    return jnp.diag(sd)


def contrasts(count: int) -> Float[Array, "count k"]:
    """Return an orthonormal basis of deviations that sum to zero, [count, count−1]."""
    return jnp.asarray(helmert(count).T)


def _measured_rows(problem: "Problem", values: Values) -> _Rows:
    records, before = problem.rows, problem.before
    mean, noise = predict_rows(problem, values, records, None)
    sd = with_rounding(noise, problem.step).sd[0]
    real = measured(len(sd), problem.count)
    correlation = values.get(CORRELATION, 0.0)
    following = 0 if before is None else jnp.sum(before >= 0)

    def white(column):
        """Return a column where the noise is independent and of sd 1."""
        scaled = (jnp.where(real, 1.0 / sd, 0.0) * column.T).T
        return scaled if before is None else whiten(scaled, before, correlation)

    log_scale = jnp.sum(jnp.where(real, jnp.log(sd) + _HALF_LOG_2PI, 0.0))
    return _Rows(
        white(records.force - mean),
        {"run": (white(jnp.ones_like(sd)), jnp.asarray(records.run))},
        None if problem.columns is None else white(problem.columns),
        log_scale + log_volume(following, correlation),
    )


def _compressed_rows(problem: "Problem", values: Values) -> _Rows:
    assert problem.blocks is not None
    correlation = values.get(CORRELATION, 0.0)
    blocks = problem.blocks.whitened(correlation)
    # Sheppard's correction, which is exact to 2 exp(−2π²σ²/step²).
    square = values["sigma"] ** 2 + blocks.known_sd**2 + rounding_variance(problem.step)
    sd = jnp.sqrt(square)
    factor = blocks.factor / sd
    slope = linear_coefficients(
        member_base(problem, {**values, "force_offset": 0.0}), problem.reading
    )
    core = linear_coefficients(
        member_base(problem, values, blocks.run, blocks.specimen), problem.reading
    )
    core = jnp.broadcast_to(core, (len(blocks.count), CORE))
    fitted = jnp.einsum("gij,gj->gi", factor[..., :CORE], core)
    log_scale = jnp.sum(blocks.count) * (jnp.log(sd) + _HALF_LOG_2PI)
    columns = {
        "run": (factor[..., ONE], blocks.run),
        "specimen": (factor[..., :CORE] @ slope, blocks.specimen),
    }
    size = factor.shape[1]
    return _Rows(
        (factor[..., -1] - fitted).reshape(-1),
        {n: (c.reshape(-1), jnp.repeat(of, size)) for n, (c, of) in columns.items()},
        factor[..., CORE:-1].reshape(fitted.size, -1),
        log_scale + log_volume(jnp.sum(blocks.following), correlation),
    )


def draw_members(problem: "Problem", values: Values, key: Key[Array, ""]) -> dict:
    """Draw the integrated members given the shared parameters of one draw."""
    scores, drawn = linear_part(problem, values).draw(key), {}
    for kind in problem.integrated:
        root = _root(problem, values, kind)
        drawn[MEMBERS[kind]] = root @ scores[: root.shape[1]]
        scores = scores[root.shape[1] :]
    return drawn
