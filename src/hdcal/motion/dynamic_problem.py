"""Inference problem of a gear in motion, and its posterior.

The force is the input, taken as read and linear between the rows; the deformation is
the output, read with an offset and white noise.
"""

from collections.abc import Mapping
from functools import cached_property
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
import numpyro
from jax import jit
from jaxtyping import Float

from hdcal.data.case import Case, Gear
from hdcal.data.prior import Prior, scaled
from hdcal.data.records import Array
from hdcal.data.theory_names import SPRING, Theory
from hdcal.errors import Finding, InputError
from hdcal.inference.force_model.model import sample_site, sample_stiffness
from hdcal.inference.force_model.padding import measured, pad_records
from hdcal.inference.force_model.priors import influence_prior, unit_stiffness
from hdcal.inference.force_model.problem import Problem, case_reading, without_texts
from hdcal.inference.force_model.values import (
    apply_gains,
    stiffness_at_read_reference,
)
from hdcal.inference.posterior import Posterior
from hdcal.inference.sampled_problem import Sampled, Values
from hdcal.physics.dynamics import natural_frequency, ring_mass
from hdcal.physics.linear_response import LinearGear, linear_response

# Parameters of the oscillation; K, E0 and gauges come before them.
SITES = (
    *("alpha", "mass", "damping_ratio", "deformation_offset", "initial_deformation"),
    *("initial_velocity", "deformation_sigma"),
)
_ring_mass = jit(ring_mass, static_argnames=("radial_per_read",))


class DynamicProblem(Sampled):
    """Data [s, N, mm] and priors, in code units, of the dynamic model.

    The unit stiffness is k_theory/E per displacement as read [mm], the rise the mean of
    T − T_ref over the test [K], the change that of T from its mean [K], None where
    there is none. Rows beyond the count are padding, with later times.
    """

    priors: dict[str, Prior]
    unit_stiffness: Float[Array, ""] | float
    rise: Float[Array, ""] | float
    change: Float[Array, " n"] | None
    time: Float[Array, " n"]
    force: Float[Array, " n"]
    deformation: Float[Array, " n"]
    count: int

    def declare(self) -> None:
        """Declare the joint density of parameters and data to NumPyro."""
        values = sample_stiffness(self.priors)
        for name in SITES:
            values[name] = sample_site(name, self.priors[name])
        for name, value in oscillation(self, values).items():
            numpyro.deterministic(name, value)
        numpyro.factor("deformation", self.log_likelihood(values))

    def log_likelihood(self, values: Values) -> Float[Array, ""]:
        """Return the log likelihood of the measured rows [log 1/mm]."""
        each = pointwise(self, values)
        return jnp.sum(jnp.where(measured(len(each), self.count), each, 0.0))


def dynamic_site_priors(case: Case, theory: Theory) -> dict[str, Prior]:
    """Return the priors of all parameters; `mass_prior` raises its error."""
    gear = case.gear
    table = {**gear.priors, **gear.dynamic_priors, **gear.gauge_priors}
    table["mass"] = mass_prior(gear, case_reading(case).radial_per_read)
    table["K"] = influence_prior(case, theory)
    return {name: table[name] for name in ("K", "E0", *gear.gauge_priors, *SITES)}


def mass_prior(gear: Gear, radial_per_read: float) -> Prior:
    """Return the prior of the moved mass per displacement as read [N·s²/mm]."""
    if "mass" in gear.dynamic_priors:
        return gear.dynamic_priors["mass"]
    if gear.theory == SPRING:
        words = "the theory 'spring' has no sizes to compute the moved mass from"
        remedy = "Add mass to [priors] of the gear file"
        raise InputError([Finding(gear.name, words, remedy)])
    if gear.density is None or "mass_ratio" not in gear.dynamic_priors:
        words = "the material file has no density to compute the moved mass from"
        remedy = "Add [density] to the material, or mass to [priors] of the gear file"
        raise InputError([Finding(gear.material, words, remedy)])
    read = {"radial_per_read": radial_per_read}
    ring = float(_ring_mass(gear.geometry, gear.density, **read))
    prior = scaled(gear.dynamic_priors["mass_ratio"], ring)
    source = f"moved mass of a bare ring: {1e3 * ring:.3g} kg; {prior.source}"
    return Prior(prior.family, prior.numbers, "N*s^2/mm", source)


def build_dynamic(
    case: Case, priors: Mapping[str, Prior], theory: Theory
) -> DynamicProblem:
    """Return the inference problem of a case, with priors of `dynamic_site_priors`."""
    records, reading = case.records, case_reading(case)
    mean, padded = float(np.mean(records.temperature)), pad_records(records)
    count, time = len(records.force), np.asarray(records.time) - records.time[0]
    beyond = np.arange(1, len(padded.force) - count + 1) * (time[-1] - time[-2])
    return DynamicProblem(
        priors=without_texts(priors),
        unit_stiffness=unit_stiffness(case, theory) * reading.radial_per_read,
        rise=mean - reading.reference_temperature,
        change=padded.temperature - mean if np.ptp(records.temperature) else None,
        time=np.concatenate([time, time[-1] + beyond]),
        force=padded.force,
        deformation=padded.deformation,
        count=count,
    )


def oscillation(problem: DynamicProblem, values: Values) -> dict:
    """Return stiffness at T_ref [N/mm], and others at the mean temperature of the test.

    These are `warm_stiffness` [N/mm], `damping` [N·s/mm] and `natural_frequency` [Hz].
    """
    stiffness = values["K"] * values["E0"] * problem.unit_stiffness
    reference = stiffness_at_read_reference(values, stiffness)
    warm = reference * (1.0 - values["alpha"] * problem.rise)
    return {
        "stiffness": stiffness,
        "warm_stiffness": warm,
        "damping": 2.0 * values["damping_ratio"] * jnp.sqrt(warm * values["mass"]),
        "natural_frequency": natural_frequency(values["mass"], warm),
    }


def stiffness_shares(problem: DynamicProblem, alpha):
    """Return the stiffness of each step over that at the mean temperature [-]."""
    if problem.change is None:
        return 1.0
    change = 0.5 * (problem.change[1:] + problem.change[:-1])
    return 1.0 - alpha * change / (1.0 - alpha * problem.rise)


def predict_motion(problem: DynamicProblem, values: Values) -> Float[Array, " n"]:
    """Return the mean reading of the deformation at the padded rows [mm]."""
    derived = oscillation(problem, values)
    stiffness = derived["warm_stiffness"] * stiffness_shares(problem, values["alpha"])
    parts = values["mass"], derived["damping"], stiffness
    gear = LinearGear(*(apply_gains(values, part) for part in parts))
    start = jnp.stack([values["initial_deformation"], values["initial_velocity"]])
    rows = problem.time, problem.force, start
    return linear_response(gear, *rows)[:, 0] + values["deformation_offset"]


def motion_rows(problem: DynamicProblem, values: Values) -> np.ndarray:
    """Return the mean reading of the deformation at the measured rows [mm]."""
    return np.asarray(_motion(problem, values))[: problem.count]


_motion = jit(predict_motion)


def pointwise(problem: DynamicProblem, values: Values) -> Float[Array, " n"]:
    """Return the log likelihood of each padded row [log 1/mm]."""
    sd = values["deformation_sigma"]
    error = (problem.deformation - predict_motion(problem, values)) / sd
    return -0.5 * (error**2 + jnp.log(2.0 * jnp.pi)) - jnp.log(sd)


class DynamicPosterior(Posterior):
    """A dynamic calibration, without an offset of the force and without effects."""

    kind: ClassVar[str] = "dynamic"

    @cached_property
    def effective_priors(self) -> Mapping[str, Prior]:
        """The priors; none depends on another parameter."""
        return self.priors

    @cached_property
    def problem(self) -> Problem:
        """Raise `InputError`, as there is no model of the force as read."""
        words = "is a dynamic calibration, which has no model of the static force"
        remedy = "Use a static calibration, or `hdcal respond`"
        raise InputError([Finding(self.case.name, words, remedy)])

    @cached_property
    def moving(self) -> DynamicProblem:
        """The inference problem that was sampled."""
        return build_dynamic(self.case, self.priors, self.theory)
