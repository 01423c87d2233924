"""The gear as an oscillator, as an inference problem: data, priors, density, model.

The force is the input and taken as read, linear between the rows; the deformation is
the output, read with a zero of its own and white noise.
"""

from collections.abc import Mapping
from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import numpyro
from jaxtyping import Float

from hdcal.data.case import Case, Gear, Theory
from hdcal.data.prior import Prior, scaled
from hdcal.data.records import Array
from hdcal.errors import Finding, InputError
from hdcal.inference.density import log_likelihood
from hdcal.inference.gauges import where_read, with_gains
from hdcal.inference.model import model, sample_site, sample_stiffness
from hdcal.inference.padding import measured, pad_records
from hdcal.inference.problem import (
    case_reading,
    influence_prior,
    unit_stiffness,
    without_texts,
)
from hdcal.inference.sampled_problem import Sampled
from hdcal.inference.values import Values
from hdcal.physics.dynamics import natural_frequency, ring_mass
from hdcal.physics.linear_response import linear_response

# In the order in which they are sampled and reported; K and E0 come first.
SITES = (
    "alpha",
    "mass",
    "damping_ratio",
    "deformation_offset",
    "initial_deformation",
    "initial_velocity",
    "deformation_sigma",
)


class DynamicProblem(Sampled):
    """Everything the dynamic model needs.

    Attributes:
        priors: by site name, in code units; K under the problem's own theory.
        unit_stiffness: k_theory/E per displacement as read [mm].
        rise: T − T_ref of the test [K].
        time: since the first row [s], padded: it goes on with the last step.
        force: on the gear, as read [N], padded: it is held.
        deformation: as read [mm], padded.
        count: measured rows.
    """

    priors: dict[str, Prior]
    unit_stiffness: Float[Array, ""] | float
    rise: Float[Array, ""] | float
    time: Float[Array, " n"]
    force: Float[Array, " n"]
    deformation: Float[Array, " n"]
    count: int


def mass_prior(gear: Gear, radial_per_read: float) -> Prior:
    """Return the prior of the moved mass per displacement as read [N·s²/mm].

    Raises:
        InputError: it rests on the material's density, which is not known.
    """
    if "mass" in gear.dynamic_priors:
        return gear.dynamic_priors["mass"]
    if gear.density is None or "mass_ratio" not in gear.dynamic_priors:
        words = "no density of the material is known, so nor is the moved mass"
        remedy = "Add [density] to the material, or mass to the gear file's [priors]"
        raise InputError([Finding(gear.material, words, remedy)])
    ring = float(ring_mass(gear.geometry, gear.density, radial_per_read))
    prior = scaled(gear.dynamic_priors["mass_ratio"], ring)
    source = f"{1e3 * ring:.3g} kg move on a bare ring; {prior.source}"
    return Prior(prior.family, prior.numbers, "N*s^2/mm", source)


def dynamic_site_priors(case: Case, theory: Theory) -> dict[str, Prior]:
    """Return the priors of every site of the dynamic model.

    Raises:
        InputError: the moved mass has none.
    """
    gear = case.gear
    table = {**gear.priors, **gear.dynamic_priors, **gear.gauge_priors}
    table["mass"] = mass_prior(gear, case_reading(case).radial_per_read)
    table["K"] = influence_prior(case, theory)
    return {name: table[name] for name in ("K", "E0", *gear.gauge_priors, *SITES)}


def build_dynamic(case: Case, priors: Mapping[str, Prior], theory: Theory):
    """Turn a case into a dynamic inference problem.

    Args:
        case: one run at one temperature, with time.
        priors: from `dynamic_site_priors`.
        theory: which stiffness K multiplies.
    """
    records, reading = case.records, case_reading(case)
    rise = float(np.mean(records.temperature)) - reading.reference_temperature
    padded, count = pad_records(records), len(records.force)
    time = np.asarray(records.time) - records.time[0]
    beyond = np.arange(1, len(padded.force) - count + 1) * (time[-1] - time[-2])
    return DynamicProblem(
        priors=without_texts(priors),
        unit_stiffness=unit_stiffness(case, theory) * reading.radial_per_read,
        rise=rise,
        time=np.concatenate([time, time[-1] + beyond]),
        force=padded.force,
        deformation=padded.deformation,
        count=count,
    )


def oscillation(problem: DynamicProblem, values: Values) -> dict:
    """Return true stiffness, damping and frequency that belong to the sampled values.

    `stiffness` is at T_ref, `warm_stiffness` [N/mm] at the temperature of the test,
    as are `damping` [N·s/mm] and `natural_frequency` [Hz].
    """
    stiffness = values["K"] * values["E0"] * problem.unit_stiffness
    warm = where_read(values, stiffness) * (1.0 - values["alpha"] * problem.rise)
    damping = 2.0 * values["damping_ratio"] * jnp.sqrt(warm * values["mass"])
    return {
        "stiffness": stiffness,
        "warm_stiffness": warm,
        "damping": damping,
        "natural_frequency": natural_frequency(values["mass"], warm),
    }


def predict_states(problem: DynamicProblem, values: Values) -> Float[Array, "n 2"]:
    """Return deformation [mm] and speed [mm/s] at the padded rows."""
    own = oscillation(problem, values)
    start = jnp.stack([values["initial_deformation"], values["initial_velocity"]])
    return linear_response(
        with_gains(values, values["mass"]),
        with_gains(values, own["damping"]),
        with_gains(values, own["warm_stiffness"]),
        problem.time,
        problem.force,
        start,
    )


def predict_motion(problem: DynamicProblem, values: Values) -> Float[Array, " n"]:
    """Return the mean reading of the deformation at the padded rows [mm]."""
    return predict_states(problem, values)[:, 0] + values["deformation_offset"]


def stretch(problem: DynamicProblem, first: int, rows: int) -> DynamicProblem:
    """Return the problem with some of its padded rows only.

    Args:
        problem: data and priors.
        first: index of the first of them.
        rows: their number; past the end they are fewer.
    """
    part = slice(first, first + rows)
    return replace(
        problem,
        time=problem.time[part],
        force=problem.force[part],
        deformation=problem.deformation[part],
        count=max(min(problem.count - first, rows), 0),
    )


def pointwise(problem: DynamicProblem, values: Values) -> Float[Array, " n"]:
    """Return the log likelihood of each padded row [log 1/mm]."""
    sd = values["deformation_sigma"]
    error = (problem.deformation - predict_motion(problem, values)) / sd
    return -0.5 * (error**2 + jnp.log(2.0 * jnp.pi)) - jnp.log(sd)


@log_likelihood.register
def _(problem: DynamicProblem, values: Values) -> Float[Array, ""]:
    each = pointwise(problem, values)
    return jnp.sum(jnp.where(measured(len(each), problem.count), each, 0.0))


@model.register
def _(problem: DynamicProblem) -> None:
    priors = problem.priors
    values = sample_stiffness(priors)
    values |= {name: sample_site(name, priors[name]) for name in SITES}
    for name, value in oscillation(problem, values).items():
        numpyro.deterministic(name, value)
    numpyro.factor("deformation", log_likelihood(problem, values))
