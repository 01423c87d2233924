"""Force that one draw predicts for one gear in one mounting, in JAX."""

from dataclasses import replace
from typing import Literal, get_args

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from hdcal.data.records import Array, Records
from hdcal.inference.force_model.problem import Problem
from hdcal.inference.force_model.values import (
    Values,
    build_effects,
    gauge_readings,
    member_base,
    true_force,
)
from hdcal.physics.chain import predict_reading
from hdcal.physics.effect import Noise

# A reading is what the rig's force gauge shows, with its zero and its errors; the load
# acts on the mounted gear; `gear` is the load on a gear outside any rig.
Quantity = Literal["reading", "load"]
QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)
# Stages of the effects that belong to the gear: mounted in the rig, and by itself.
_STAGES = {"load": frozenset({"deformation", "force"}), "gear": frozenset({"force"})}


def grid_records(deformation, temperature, sense, known_sd, gear=None) -> Records:
    """Return immediate readings after a reset, (n,), that were not measured.

    Each is of a gear of its own, without memory of other rows, unless `gear` numbers
    them.
    """
    zeros = np.zeros(len(deformation))
    index = np.arange(len(deformation)) if gear is None else gear
    return Records(
        deformation=deformation,
        temperature=temperature,
        time=zeros,
        angle=zeros,
        direction=sense,
        sense=sense,
        rate=zeros,
        run=index,
        specimen=index,
        force=zeros,
        force_sd=zeros + known_sd,
        known=frozenset(),
    )


def force_of(
    problem: Problem,
    values: Values,
    records: Records,
    *,
    factor: Float[Array, "*n"] | float = 1.0,
    moved: Float[Array, "*n"] | float = 0.0,
    quantity: Quantity | Literal["gear"] = "reading",
) -> tuple[Float[Array, " n"], Noise]:
    """Compute mean force and noise [N] of one draw, without the discrepancy.

    The factor is the stiffness relative to the tested gear's, `moved` the radial
    deformation that a warmer frame gains [mm]. A `reading` has the zero of the force
    and the effects of the sensor; a `load`, at true deformation and temperature, lacks
    them and the gain of the gauge; a `gear` also lacks the zero of the deformation and
    the compliance of the rig.
    """
    effects = build_effects(problem, values)
    base = member_base(problem, values)
    offset = base.deformation_offset - moved / problem.reading.radial_per_read
    base = replace(base, stiffness=base.stiffness * factor, deformation_offset=offset)
    if quantity == "reading":
        return predict_reading(base, effects, records, problem.reading)
    base = replace(base, force_offset=jnp.zeros_like(base.force_offset))
    if quantity == "gear":
        base = replace(base, deformation_offset=jnp.zeros_like(offset))
    effects = tuple(e for e in effects if e.stage in _STAGES[quantity])
    at, warm = gauge_readings(values, records.deformation, records.temperature)
    records = replace(records, deformation=at, temperature=warm)
    force, noise = predict_reading(base, effects, records, problem.reading)
    return true_force(values, force), noise


@jax.jit(static_argnames=("quantity", "asked"))
def forces_of_draws(
    problem: Problem,
    draws: Values,
    path: Records,
    factor: Float[Array, "draw node n"],
    moved: Float[Array, "draw n"],
    share: Float[Array, " asked"],
    *,
    quantity: Quantity | Literal["gear"],
    asked: int,
):
    """Compute the force of every draw, its slope by the stiffness, and the noise.

    The last rows of the path are the conditions asked for. Factor and `moved` are as in
    `force_of`; `share` is the part of the fitted discrepancy that acts. Half a loop
    acts whole: it does not end with the tested range.

    Returns:
        Force (draw, node, asked) and its derivative by the factor [N], logarithms of
        the shares of the components of the noise (draw, node, component), their sds
        (draw, node, component, asked) [N], and the discrepancy in the force
        (draw, asked) [N].
    """

    def of_draw(value, factor, moved):
        middle = replace(path, sense=jnp.zeros_like(path.sense))
        whole, mean = (
            fitted_discrepancy(problem, value, rows, quantity)[-asked:]
            for rows in (path, middle)
        )
        left = whole - (1.0 - share) * mean

        def force(factor):
            mean, noise = force_of(
                problem, value, path, factor=factor, moved=moved, quantity=quantity
            )
            scale = factor[-asked:] if quantity == "gear" else 1.0
            total = mean[-asked:] + scale * left
            return total, (noise.log_weight, noise.sd[:, -asked:])

        def with_slope(factor):
            one = jnp.ones_like(factor)
            mean, slope, noise = jax.jvp(force, (factor,), (one,), has_aux=True)
            return mean, slope, *noise

        return *jax.vmap(with_slope)(factor), left

    return jax.vmap(of_draw)(draws, factor, moved)


def fitted_discrepancy(
    problem: Problem, value: Values, rows: Records, quantity
) -> Float[Array, " n"]:
    """Return the fitted discrepancy of one draw [N], zero without one.

    It is constant beyond the tested deformation; that of a gear is counted from its
    free shape.
    """
    fitted = problem.discrepancy
    if fitted is None or "gap_weights" not in value:
        return jnp.zeros(len(rows.deformation))
    place = jnp.asarray(rows.deformation)
    if quantity != "reading":
        place, _ = gauge_readings(value, place, 0.0)
    if quantity == "gear":
        place = place + value["deformation_offset"]
    ends = fitted.centre - fitted.half_range, fitted.centre + fitted.half_range
    columns = fitted.columns(jnp.clip(place, *ends), jnp.asarray(rows.sense))
    left = columns @ value["gap_weights"]
    return left if quantity == "reading" else true_force(value, left)
