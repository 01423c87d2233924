"""NumPyro's NUTS in whitened coordinates.

Data, priors and whitening are arguments of one executable for each bucket of rows. It
advances in short stretches, for progress to be shown and interruptions to take effect.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property, partial

import jax
import jax.numpy as jnp
import numpy as np
from numpyro.infer.hmc import hmc

from hdcal.data.plausible import implausible
from hdcal.errors import Findings
from hdcal.inference.diagnostics import ESS_PER_CHAIN, have_mixed
from hdcal.inference.laplace import Whitening, potential, values_at
from hdcal.inference.sampled_problem import Sampled

# Called with (iterations done, iterations in all).
Progress = Callable[[int, int], None]

# Mean acceptance aimed at; each further value is for a run with divergences.
TARGET_ACCEPTANCE = (0.8, 0.95, 0.99)
_STRETCH = 50
# A run is extended to at most so many times the requested draws.
_LONGEST = 4
# Draws of a chain for each effective one that is needed; a shorter run is not extended.
_ENOUGH = 8
# Spread of the chains' starts in posterior sds, so that R-hat can detect disagreement.
_OVERDISPERSION = 2.0
# Statistics that are kept of each draw: ArviZ' name, and that of the sampler's state.
_STATISTICS = {
    "energy": "energy",
    "lp": "potential_energy",
    "diverging": "diverging",
    "n_steps": "num_steps",
    "acceptance_rate": "accept_prob",
}


@dataclass(frozen=True)
class Draws:
    """Draws by site name, in code units, and statistics under ArviZ' names.

    Leading axes are chain and draw.
    """

    values: dict[str, np.ndarray]
    statistics: dict[str, np.ndarray]
    target_acceptance: float

    @property
    def shape(self) -> tuple[int, int]:
        """Number of chains, and of draws of each."""
        return self.statistics["energy"].shape

    @cached_property
    def median(self) -> dict[str, np.ndarray]:
        """Median of each parameter over all draws."""
        return {name: np.median(v, axis=(0, 1)) for name, v in self.values.items()}


def sample(
    problem: Sampled,
    whitening: Whitening,
    seed: int,
    *,
    chains: int = 4,
    warmup: int = 1000,
    draws: int = 1000,
    progress: Progress | None = None,
) -> Draws:
    """Draw from the posterior; the same seed gives the same draws.

    A run with divergent trajectories is discarded and repeated with shorter steps. A
    run whose chains have not mixed is extended, to at most four times its length.

    Coordinates are those of `laplace.fit`. Numbers of iterations are those of each
    chain: `warmup` for adaptation, and `draws` kept, or a multiple of them.
    """
    for target in TARGET_ACCEPTANCE:
        run = _Run(problem, whitening, seed, chains, warmup, progress, target)
        is_last = target == TARGET_ACCEPTANCE[-1]
        run.advance(draws, stop_if_diverging=not is_last)
        if run.diverged and not is_last:
            continue
        found = _extended(run, draws)
        if is_last or not found.statistics["diverging"].any():
            return found
    raise AssertionError


def check_settings(chains: int, warmup: int, draws: int, seed: int) -> None:
    """Raise `InputError` if a run is too short for its checks, or endless."""
    settings = {"chains": chains, "warmup": warmup, "draws": draws, "seed": seed}
    with Findings() as wrong:
        for name, value in settings.items():
            wrong += implausible(name, value)


def _extended(run: "_Run", draws: int) -> Draws:
    """Return the draws of a run, extended while its chains have not mixed."""
    while True:
        found = run.draws()
        values = found.values.items()
        varying = {n: v for n, v in values if v.ndim == 2 and np.ptp(v) > 0.0}
        may_be_longer = _ENOUGH * ESS_PER_CHAIN <= found.shape[1] < _LONGEST * draws
        diverged = found.statistics["diverging"].any()
        if not may_be_longer or diverged or have_mixed(varying):
            return found
        run.advance(draws)


class _Run:
    """All chains of one step size, which can be extended."""

    def __init__(self, problem, whitening, seed, chains, warmup, progress, target):
        self._arguments = jax.device_put((problem, whitening))
        self._seed, self._warmup = seed, warmup
        self._progress, self._target = progress, target
        size = {"warmup": warmup, "chains": chains}
        self._states = [
            _start(*self._arguments, seed, chain, target, **size)
            for chain in range(chains)
        ]
        self._done, self._kept = 0, []

    def advance(self, draws: int, *, stop_if_diverging: bool = False) -> None:
        """Draw so many more from each chain, after its warm-up."""
        warmup, total = self._warmup, max(self._done, self._warmup) + draws
        while self._done < total:
            # Stretches end with the warm-up, for few lengths.
            left = (warmup if self._done < warmup else total) - self._done
            size = {"warmup": warmup, "length": min(_STRETCH, left)}
            advance = partial(_advance, *self._arguments, target=self._target, **size)
            # Each chain uses one processor.
            with ThreadPoolExecutor() as pool:
                moved = [*pool.map(advance, self._states)]
            self._states = [state for state, _ in moved]
            kept = jax.device_get([kept for _, kept in moved])
            if self._done >= warmup:
                self._kept.append(jax.tree.map(lambda *parts: np.stack(parts), *kept))
            self._done += size["length"]
            if self._progress is not None:
                self._progress(self._done, total)
            if stop_if_diverging and self.diverged:
                return

    @property
    def diverged(self) -> bool:
        """Whether a trajectory of the last stretch diverged."""
        return bool(self._kept) and bool(self._kept[-1]["diverging"].any())

    def draws(self) -> Draws:
        """Return the draws so far, with their parameters by name."""
        kept = jax.tree.map(lambda *parts: np.concatenate(parts, 1), *self._kept)
        standard, kept["lp"] = kept.pop("standard"), -kept["lp"]
        kept["tree_depth"] = np.ceil(np.log2(kept["n_steps"] + 1)).astype(int)
        named = jax.device_get(_constrain(*self._arguments, standard, self._seed))
        return Draws(named, kept, self._target)


def _kernel(problem: Sampled, whitening: Whitening, warmup: int, target):
    """Return the init and step functions of NUTS on standard coordinates."""
    init, step = hmc(
        lambda standard: potential(problem, whitening.position(standard)), algo="NUTS"
    )
    start = partial(
        init,
        num_warmup=warmup,
        target_accept_prob=target,
        trajectory_length=None,  # pyright: ignore[reportArgumentType]
    )
    return start, step


@jax.jit(static_argnames=("warmup", "chains"))
def _start(problem, whitening, seed, chain, target, *, warmup, chains):
    """Return the state in which one of the chains starts, as its leaves."""
    walks, _ = jax.random.split(jax.random.key(seed))
    place, walk = jax.random.split(jax.random.split(walks, chains)[chain])
    spread = jax.random.normal(place, (len(whitening.factor),))
    start, _ = _kernel(problem, whitening, warmup, target)
    return jax.tree.leaves(start(_OVERDISPERSION * spread, rng_key=walk))


@jax.jit(static_argnames=("warmup", "length"))
def _advance(problem, whitening, leaves, *, target, warmup, length):
    """Return the state of a chain after so many steps, and what is kept of each."""
    start, step = _kernel(problem, whitening, warmup, target)
    # The step function takes its settings from the last call of its init.
    structure = jax.tree.structure(start(jnp.zeros(len(whitening.factor))))

    def advance(state, _):
        state = step(state)
        kept = {name: getattr(state, its) for name, its in _STATISTICS.items()}
        size = state.adapt_state.step_size
        return state, {**kept, "standard": state.z, "step_size": size}

    state = jax.tree.unflatten(structure, leaves)
    state, kept = jax.lax.scan(advance, state, length=length)
    return jax.tree.leaves(state), kept


@jax.jit
def _constrain(problem, whitening, standard, seed):
    """Return parameters by name, with draws of the members that were integrated out."""
    _, members = jax.random.split(jax.random.key(seed))
    chains, draws, _ = standard.shape

    def values(drawn):
        coordinates, key = drawn
        named = values_at(problem, whitening.position(coordinates))
        return named | problem.draw_members(named, key)

    def chain(coordinates, key):
        # The key of a draw does not depend on the length of the run.
        keys = jax.vmap(partial(jax.random.fold_in, key))(jnp.arange(draws))
        # One draw after the other: members by the hundred would fill the memory.
        return jax.lax.map(values, (coordinates, keys))

    return jax.vmap(chain)(standard, jax.random.split(members, chains))
