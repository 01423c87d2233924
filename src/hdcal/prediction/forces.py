"""The force that one draw predicts, for gears and mountings like the tested ones.

Every answer about the future rests on this: bands, margins, designs and studies.
"""

from dataclasses import replace
from typing import Literal, get_args

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from hdcal.data.records import Array, Records
from hdcal.inference.density import Values, build_effects, member_base
from hdcal.inference.problem import Problem
from hdcal.physics.chain import predict_reading
from hdcal.physics.effect import Noise

# A reading is what the rig's force gauge shows, its zero and errors included; the
# load is what acts on the gear.
Quantity = Literal["reading", "load"]
QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)
_OF_THE_GEAR = frozenset({"deformation", "force"})


def grid_records(deformation, temperature, sense, known_sd: float) -> Records:
    """Return rows that were not measured: immediate readings on a fresh reset.

    Args:
        deformation: as read [mm], shape (n,).
        temperature: of the specimen [°C], shape (n,).
        sense: +1 loading, -1 unloading, shape (n,).
        known_sd: known measurement sd of a row [N].
    """
    zeros = np.zeros(len(deformation))
    index = np.zeros(len(deformation), dtype=int)
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
    factor: Float[Array, ""] | float = 1.0,
    quantity: Quantity = "reading",
) -> tuple[Float[Array, " n"], Noise]:
    """Compute mean force and noise of one draw, without the leftover discrepancy.

    Args:
        problem: structure.
        values: parameters of one draw.
        records: from `grid_records`.
        factor: stiffness relative to the tested gear's [-]: another geometry, or
            another specimen.
        quantity: `reading` includes the zero of the force and the effects of the
            sensor; `load` leaves them out.

    Returns:
        Mean force [N], and the noise of a reading of it.
    """
    effects = build_effects(problem, values)
    base = member_base(problem, values)
    base = replace(base, stiffness=base.stiffness * factor)
    if quantity == "load":
        base = replace(base, force_offset=jnp.zeros_like(base.force_offset))
        effects = tuple(e for e in effects if e.stage in _OF_THE_GEAR)
    return predict_reading(base, effects, records, problem.reading)


def gear_force(
    problem: Problem,
    values: Values,
    deformation: Float[Array, " n"],
    temperature: Float[Array, " n"],
    *,
    factor: Float[Array, " n"] | Float[Array, ""] | float = 1.0,
) -> Float[Array, " n"]:
    """Compute the force on a gear at a deformation of its own, without the rig.

    A product has neither the rig's zeros nor its compliance: ω is what the gear sees,
    counted from its free shape. Left are the force model, effects on the force and,
    where it was fitted, the leftover discrepancy. Each row is another gear, pressed
    from rest in one go.

    Args:
        problem: structure.
        values: parameters of one draw.
        deformation: radial ω [mm].
        temperature: of the gear [°C].
        factor: stiffness relative to the tested gear's [-]; the leftover discrepancy
            is taken to grow with it.

    Returns:
        Force [N].
    """
    sense = np.ones(len(deformation))
    as_read = deformation / problem.reading.radial_per_read
    records = grid_records(as_read, temperature, sense, 0.0)
    # A run for each row: what remembers starts from rest in each.
    own = np.arange(len(deformation))
    records = replace(records, run=own, specimen=own)
    base = member_base(problem, values)
    zero = jnp.zeros(())
    base = replace(
        base,
        stiffness=base.stiffness * factor,
        deformation_offset=zero,
        force_offset=zero,
    )
    effects = [e for e in build_effects(problem, values) if e.stage == "force"]
    force, _ = predict_reading(base, effects, records, problem.reading)
    if problem.discrepancy is not None:
        columns = problem.discrepancy.columns(as_read + values["deformation_offset"])
        force = force + factor * (columns @ values["gap_weights"])
    return force
