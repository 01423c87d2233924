"""The forces of the members of a population, as each draw of a posterior sees them.

Given the parameters of one draw, the force of one future member is a mixture of
normals. What is not known but the same for every member (parameters, the centre of
the population, the leftover discrepancy) is a matter of the draw and never scatter.
"""

from dataclasses import dataclass, replace
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy import stats
from scipy.stats import qmc

from hdcal.data.records import Array
from hdcal.inference.density import Values
from hdcal.inference.distributions import frozen
from hdcal.inference.posterior import Posterior
from hdcal.inference.problem import Problem
from hdcal.prediction.forces import Quantity, force_of, grid_records
from hdcal.prediction.mixture import Mixture
from hdcal.prediction.population import Population
from hdcal.prediction.size_tolerances import Nodes

# More draws than this change no digit that is printed.
MOST_DRAWS = 8000
# Where effects bend the force, a specimen's deviation is split: this share of its sd
# goes to nodes, the rest is narrow enough to go along the tangent.
_AT_NODES, _SPLIT = 0.8, 7


class Question(eqx.Module):
    """Where the force is asked for.

    Attributes:
        deformation: as read [mm].
        turn: where the movement turned before it came down [mm].
        known_sd: stated sd of a reading [N].
        low: end of the tested deformation [mm].
        high: other end [mm].
        down: whether the deformation is reached from above.
    """

    deformation: Float[Array, ""] | float
    turn: Float[Array, ""] | float
    known_sd: float
    low: float
    high: float
    down: bool = eqx.field(static=True)

    def at(self, deformation) -> "Question":
        """Return the question at another deformation [mm]."""
        return replace(self, deformation=deformation)


@dataclass(frozen=True)
class Outlook:
    """What one posterior says of a population.

    Attributes:
        posterior: from `calibrate`.
        values: its draws, with what each holds for true of the whole population.
        question: where the force is asked for.
        population: whose force.
        quantity: which force.
        nodes: of the geometry's tolerances.
    """

    posterior: Posterior
    values: Values
    question: Question
    population: Population
    quantity: Quantity
    nodes: Nodes

    @property
    def rounded(self) -> bool:
        """Whether what is asked for is read in steps."""
        return self.quantity == "reading" and float(self.posterior.problem.step) > 0.0

    def mixture(
        self, temperature: float, scale=1.0, nodes: Nodes | None = None
    ) -> Mixture:
        """Return the mixture of every draw [draw, component] at a temperature [°C].

        Args:
            temperature: of the specimen [°C].
            scale: stiffness over that of the calibrated gear [-].
            nodes: in place of its own.
        """
        return mixtures(
            self.posterior.problem,
            self.values,
            self.question,
            jnp.asarray(temperature, float),
            jnp.asarray(scale, float),
            self.nodes if nodes is None else nodes,
            population=self.population,
            quantity=self.quantity,
            rounded=self.rounded,
        )


def look_out(
    posterior: Posterior,
    question: Question,
    *,
    population: Population,
    quantity: Quantity,
    nodes: Nodes,
    seed: int,
) -> Outlook:
    """Return the outlook of a posterior.

    Args:
        posterior: from `calibrate`.
        question: where the force is asked for.
        population: whose force; see `check_population`.
        quantity: which force.
        nodes: of the geometry's tolerances.
        seed: of what the data leave open about the centre of the population.
    """
    draws = posterior.draws
    count = len(draws["K"])
    kept = np.linspace(0, count - 1, min(count, MOST_DRAWS)).round().astype(int)
    values = {name: column[kept] for name, column in draws.items()}
    spread = qmc.Sobol(5, rng=seed).random(1 << int(np.ceil(np.log2(len(kept)))))
    spread = np.clip(spread[: len(kept)], 1e-9, 1.0 - 1e-9)
    values["_standard"] = stats.norm.ppf(spread[:, :3])
    for column, name in enumerate(("gap_sd", "gap_length"), start=3):
        if name not in values:
            values[name] = _prior_draws(posterior, name, spread[:, column])
    return Outlook(posterior, values, question, population, quantity, nodes)


def _prior_draws(posterior: Posterior, name: str, levels: np.ndarray) -> np.ndarray:
    prior = posterior.priors[name]
    if prior.family == "fixed":
        return np.full(len(levels), float(prior.numbers[0]))
    return np.asarray(frozen(prior).ppf(levels))


@partial(jax.jit, static_argnames=("population", "quantity", "rounded"))
def mixtures(
    problem: Problem,
    values: Values,
    question: Question,
    temperature: Float[Array, ""],
    scale: Float[Array, ""],
    nodes: Nodes,
    *,
    population: Population,
    quantity: Quantity,
    rounded: bool,
) -> Mixture:
    """Return the forces of future members for every draw, shape [draw, component]."""
    one = partial(
        member_mixture,
        problem,
        question=question,
        temperature=temperature,
        scale=scale,
        nodes=nodes,
        population=population,
        quantity=quantity,
    )
    weight, mean, sd = jax.vmap(one)(dict(values))
    return Mixture(weight, mean, sd, problem.step if rounded else 0.0, rounded)


def member_mixture(
    problem: Problem,
    value: Values,
    *,
    question: Question,
    temperature,
    scale,
    nodes: Nodes,
    population: Population,
    quantity: Quantity,
):
    """Return weight, mean and sd of the components of one draw.

    Tested deviations are from the mean of the tested members. The population's own
    centre lies sd/√n from it, known to nobody: one place of it in each draw.
    """
    specimens = problem.specimens if population == "specimens" else 0
    own = value["specimen_sd"] if specimens else 0.0
    centre = own * value["_standard"][0] / np.sqrt(max(specimens, 1))
    place, share, tangent = _split(bool(specimens and problem.effects))
    base = scale * nodes.factor[:, None]
    factor = base * (1.0 + centre + own * place)
    within = factor * (nodes.width / nodes.factor)[:, None]
    width2 = ((base * own * tangent) ** 2 + within**2).ravel()
    at = partial(member_force, problem, value, question, temperature, quantity)
    one = jnp.ones(())
    mean, slope, (log_weight, noise) = jax.vmap(
        lambda f: jax.jvp(at, (f,), (one,), has_aux=True)
    )(factor.ravel())
    own_zero = problem.runs and population != "readings" and quantity == "reading"
    zero = value["run_offset_sd"] if own_zero else 0.0
    shift = zero * value["_standard"][1] / np.sqrt(max(problem.runs, 1))
    shift = shift + leftover(problem, value, question)
    variance = noise**2 + zero**2 + (slope**2 * width2)[:, None]
    # The root of zero has no derivative.
    spread = jnp.sqrt(variance + 1e-24)
    weight = (nodes.weight[:, None] * share).reshape(-1, 1) * jnp.exp(log_weight)
    mean = jnp.broadcast_to((mean + shift)[:, None], spread.shape)
    return weight.ravel(), mean.ravel(), spread.ravel()


def _split(bent: bool):
    """Return nodes and weights of a standard normal, and the sd that is left over."""
    if not bent:
        return np.zeros(1), np.ones(1), 1.0
    place, share = np.polynomial.hermite_e.hermegauss(_SPLIT)
    return _AT_NODES * place, share / share.sum(), np.sqrt(1.0 - _AT_NODES**2)


def member_force(problem, value, question: Question, temperature, quantity, factor):
    """Return the mean force of one member, and weights and sds of its noise."""
    along, sense = [question.deformation], [1.0]
    if question.down:
        along, sense = [question.turn, question.deformation], [1.0, -1.0]
    path = jnp.stack([jnp.asarray(each, float) for each in along])
    warmth = jnp.full(len(along), temperature)
    records = grid_records(path, warmth, np.array(sense), question.known_sd)
    mean, noise = force_of(problem, value, records, factor=factor, quantity=quantity)
    if quantity == "load":
        return mean[-1], (jnp.zeros(1), jnp.zeros(1))
    return mean[-1], (noise.log_weight, noise.sd[:, -1])


def leftover(problem: Problem, value: Values, question: Question):
    """Return the leftover discrepancy of one draw [N].

    Where it was fitted and tested this is what was found. At a distance d beyond the
    tested deformation it is a new normal of sd s √(1 − exp(−(d/ℓ)²)), beside what the
    end of the tested range still tells; s and ℓ are from the prior where no
    discrepancy was fitted.
    """
    at, low, high = question.deformation, question.low, question.high
    beyond = jnp.maximum(jnp.maximum(low - at, at - high), 0.0)
    length = value["gap_length"] * (high - low)
    new = -jnp.expm1(-((beyond / length) ** 2))
    # The root has no derivative at zero.
    new = jnp.sqrt(jnp.where(new > 0.0, new, 1.0)) * (new > 0.0)
    found = value["gap_sd"] * new * value["_standard"][2]
    if problem.discrepancy is None or "gap_weights" not in value:
        return found
    columns = problem.discrepancy.columns_beyond(
        jnp.reshape(jnp.asarray(at, float), 1), value["gap_length"]
    )
    return found + (columns @ value["gap_weights"])[0]
