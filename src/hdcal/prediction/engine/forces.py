"""The force that one draw predicts for one gear in one mounting.

Every answer about the future rests on `force_of`: bands, margins, designs and studies.
"""

from dataclasses import replace
from typing import Literal, get_args

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from hdcal.data.records import Array, Records
from hdcal.inference.gauges import acting, shown
from hdcal.inference.problem import Problem
from hdcal.inference.values import Values, build_effects, member_base
from hdcal.physics.chain import predict_reading
from hdcal.physics.effect import Noise

# A reading is what the rig's force gauge shows, its zero and errors included; the
# load is what acts on the gear.
Quantity = Literal["reading", "load"]
QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)
# Stages of the effects that are the gear's: mounted in the rig, and by itself.
_STAGES = {"load": frozenset({"deformation", "force"}), "gear": frozenset({"force"})}


def grid_records(deformation, temperature, sense, known_sd, gear=None) -> Records:
    """Return rows that were not measured: immediate readings on a fresh reset.

    Args:
        deformation: as read [mm], shape (n,).
        temperature: of the specimen [°C], shape (n,).
        sense: +1 where the deformation rises, -1 where it falls, shape (n,).
        known_sd: known measurement sd of a row [N].
        gear: which fresh gear, in a mounting of its own, a row is of, shape (n,); by
            default each row is of another, so that none remembers another.
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
    factor: Float[Array, ""] | float = 1.0,
    zero: Float[Array, "*n"] | float = 0.0,
    moved: Float[Array, "*n"] | float = 0.0,
    quantity: Quantity | Literal["gear"] = "reading",
) -> tuple[Float[Array, " n"], Noise]:
    """Compute mean force and noise of one draw, without the leftover discrepancy.

    Args:
        problem: structure.
        values: parameters of one draw.
        records: from `grid_records`; for a load or a gear in true terms, without
            the gauges' gains and the thermometer's offset.
        factor: stiffness relative to the tested gear's [-]: another geometry, or
            another specimen.
        zero: of another mounting, or of a warmer gauge, from that of the tested
            ones [N].
        moved: radial deformation that a warmer frame gains [mm].
        quantity: `reading` includes the zero of the force and the effects of the
            sensor; `load` leaves them out, and the gauge's gain; `gear` also leaves
            out the zero of the deformation and the compliance of the rig.

    Returns:
        Mean force [N], and the noise of a reading of it.
    """
    effects = build_effects(problem, values)
    base = member_base(problem, values)
    base = replace(
        base,
        stiffness=base.stiffness * factor,
        force_offset=base.force_offset + zero,
        deformation_offset=base.deformation_offset
        - moved / problem.reading.radial_per_read,
    )
    if quantity != "reading":
        base = replace(base, force_offset=jnp.zeros_like(base.force_offset))
        effects = tuple(e for e in effects if e.stage in _STAGES[quantity])
    if quantity == "gear":
        nothing = jnp.zeros_like(base.deformation_offset)
        base = replace(base, deformation_offset=nothing)
    if quantity == "reading":
        return predict_reading(base, effects, records, problem.reading)
    at, warm = shown(values, records.deformation, records.temperature)
    records = replace(records, deformation=at, temperature=warm)
    force, noise = predict_reading(base, effects, records, problem.reading)
    return acting(values, force), noise
