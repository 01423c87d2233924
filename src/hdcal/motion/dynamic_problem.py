"""The gear as an oscillator, as an inference problem: data, priors, density, model.

The force is the input and taken as read, linear between the rows; the deformation is
the output, read with a zero of its own and white noise.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import numpyro
from jaxtyping import Float

from hdcal.data.case import Case
from hdcal.data.prior import Prior
from hdcal.data.records import Array
from hdcal.data.theory_names import Theory
from hdcal.inference.distributions import distribution
from hdcal.inference.gauges import where_read, with_gains
from hdcal.inference.likelihood import log_likelihood
from hdcal.inference.model import sample_amplitude, sample_site, sample_stiffness
from hdcal.inference.padding import measured, pad_records
from hdcal.inference.problem import (
    case_reading,
    unit_stiffness,
    without_texts,
)
from hdcal.inference.sampled_problem import Sampled
from hdcal.inference.values import Values
from hdcal.motion.dynamic_priors import FRICTION, SITES
from hdcal.physics.dynamics import natural_frequency
from hdcal.physics.effect import Effect
from hdcal.physics.frictional_response import frictional_response
from hdcal.physics.linear_response import LinearGear, linear_response

# Where the gear would stop, had it begun in balance: a coordinate of the sampler.
STOP = "_initial_stop"
# Keeps the root of zero from having no slope [N²].
_TINY = 1e-20


class DynamicProblem(Sampled):
    """Everything the dynamic model needs.

    Attributes:
        priors: by site name, in code units; K under the problem's own theory.
        units: of the coordinates of half-normal amplitudes, in code units.
        unit_stiffness: k_theory/E per displacement as read [mm].
        rise: mean of T − T_ref over the test [K].
        change: of T from its mean, padded [K]; None where it does not change.
        time: since the first row [s], padded: it goes on with the last step.
        force: on the gear, as read [N], padded: it is held.
        deformation: as read [mm], padded.
        count: measured rows.
        effects: in the model, of which it knows dry friction.
    """

    priors: dict[str, Prior]
    units: dict[str, float]
    unit_stiffness: Float[Array, ""] | float
    rise: Float[Array, ""] | float
    change: Float[Array, " n"] | None
    time: Float[Array, " n"]
    force: Float[Array, " n"]
    deformation: Float[Array, " n"]
    count: int
    effects: tuple[type[Effect], ...] = eqx.field(static=True, default=())

    def declare(self) -> None:
        """Declare the joint density of parameters and data to NumPyro."""
        values = sample_stiffness(self.priors)
        if self.effects:
            values |= _sample_frictional(self, values)
        else:
            values |= {name: sample_site(name, self.priors[name]) for name in SITES}
        for name, value in oscillation(self, values).items():
            numpyro.deterministic(name, value)
        numpyro.factor("deformation", log_likelihood(self, values))

    @property
    def non_smooth(self) -> bool:
        """Whether its density has bends: with friction, where one more swing begins."""
        return bool(self.effects)


def build_dynamic(
    case: Case,
    priors: Mapping[str, Prior],
    theory: Theory,
    effects: Sequence[type[Effect]] = (),
) -> DynamicProblem:
    """Turn a case into a dynamic inference problem.

    Args:
        case: one run, with time.
        priors: from `dynamic_site_priors`.
        theory: which stiffness K multiplies.
        effects: in the model; none but dry friction.
    """
    records, reading = case.records, case_reading(case)
    mean = float(np.mean(records.temperature))
    padded, count = pad_records(records), len(records.force)
    time = np.asarray(records.time) - records.time[0]
    beyond = np.arange(1, len(padded.force) - count + 1) * (time[-1] - time[-2])
    return DynamicProblem(
        priors=without_texts(priors),
        # Coarse: what the data resolve is known after a first fit.
        units={
            name: float(prior.numbers[0])
            for name, prior in priors.items()
            if name == FRICTION and prior.family == "half_normal"
        },
        unit_stiffness=unit_stiffness(case, theory) * reading.radial_per_read,
        rise=mean - reading.reference_temperature,
        change=padded.temperature - mean if np.ptp(records.temperature) else None,
        effects=tuple(effects),
        time=np.concatenate([time, time[-1] + beyond]),
        force=padded.force,
        deformation=padded.deformation,
        count=count,
    )


def oscillation(problem: DynamicProblem, values: Values) -> dict:
    """Return true stiffness, damping and frequency that belong to the sampled values.

    `stiffness` is at T_ref, `warm_stiffness` [N/mm] at the mean temperature of the
    test, as are `damping` [N·s/mm] and `natural_frequency` [Hz].
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
    gear = LinearGear(
        with_gains(values, values["mass"]),
        with_gains(values, own["damping"]),
        with_gains(values, step_stiffness(problem, values, own["warm_stiffness"])),
    )
    if problem.effects:
        friction = values[FRICTION]
        return frictional_response(gear, friction, problem.time, problem.force, start)
    return linear_response(gear, problem.time, problem.force, start)


def step_stiffness(problem: DynamicProblem, values: Values, mean):
    """Return the stiffness of each step, or of all, from that at the mean [N/mm]."""
    if problem.change is None:
        return mean
    change = 0.5 * (problem.change[1:] + problem.change[:-1])
    alpha = values["alpha"]
    return mean * (1.0 - alpha * change / (1.0 - alpha * problem.rise))


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
        change=None if problem.change is None else np.asarray(problem.change)[part],
        time=np.asarray(problem.time)[part],
        force=np.asarray(problem.force)[part],
        deformation=np.asarray(problem.deformation)[part],
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


def stopping_distance(problem: DynamicProblem, values: Values):
    """Return d [mm], how far the initial speed takes a gear: ½ m v² = f d + ½ k d²."""
    stiffness = oscillation(problem, values)["warm_stiffness"]
    speed, friction = values["initial_velocity"], values[FRICTION]
    twice = stiffness * values["mass"] * speed**2
    return (
        values["mass"]
        * speed
        * jnp.abs(speed)
        / (friction + jnp.sqrt(friction**2 + twice + _TINY))
    )


def _sample_frictional(problem: DynamicProblem, values: Values) -> dict:
    """Sample what `SITES` names and the friction.

    Data see where friction stopped the gear, and along with the speed at the first row
    the deformation there moves on a parabola. The place is sampled instead, and its
    formal law taken off again.
    """
    priors, name = problem.priors, "initial_deformation"
    found = {n: sample_site(n, priors[n]) for n in SITES if n != name}
    unit = problem.units.get(FRICTION)
    found[FRICTION] = sample_amplitude(FRICTION, priors[FRICTION], unit)
    if priors[name].family != "normal":
        return found | {name: sample_site(name, priors[name])}
    law = distribution(priors[name])
    stop = jnp.asarray(numpyro.sample(STOP, law))
    begin = stop - stopping_distance(problem, {**values, **found})
    change = jnp.asarray(law.log_prob(begin)) - jnp.asarray(law.log_prob(stop))
    numpyro.factor(f"{STOP}_prior", change)
    return found | {name: numpyro.deterministic(name, begin)}
