"""The sampler of record: NumPyro's NUTS in whitened coordinates.

One executable serves every data set of one bucket of rows, because data, priors and
whitening are arguments of it. It advances in short stretches, so that progress can
be shown and an interruption is heard.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from numpyro.infer.hmc import hmc

from hdcal.data.plausible import implausible
from hdcal.errors import Findings
from hdcal.exported import jit
from hdcal.inference.integrated import draw_members
from hdcal.inference.laplace import Whitening, potential, values_at
from hdcal.inference.mixing import ESS_PER_CHAIN, have_mixed
from hdcal.inference.sampled_problem import Sampled

# Called with (iterations done, iterations in all).
Progress = Callable[[int, int], None]

MAX_TREE_DEPTH = 10
# Mean acceptance aimed at; each further value is for a run that was not sound.
TARGET_ACCEPTANCE = (0.8, 0.95, 0.99)
_STRETCH = 50
# A run goes on until so many times the draws that were asked for.
_LONGEST = 4
# Draws of a chain over the effective ones that it needs, from which their lack tells.
_TELLING = 8
# Place of the divergences in what `_advance` keeps of a draw.
_DIVERGING = 3
# Chains start this many posterior sds apart, so that R-hat can see them disagree.
_OVERDISPERSION = 2.0


@dataclass(frozen=True)
class Draws:
    """Draws and how they were come by; leading axes are chain and draw.

    Attributes:
        values: by site name, in code units.
        energy: Hamiltonian of each draw.
        potential: −log posterior density in unconstrained coordinates.
        diverging: whether the trajectory diverged.
        n_steps: leapfrog steps of the trajectory.
        acceptance: mean acceptance probability of the trajectory.
        step_size: adapted step size.
        target_acceptance: mean acceptance that the step size was adapted to.
    """

    values: dict[str, np.ndarray]
    energy: np.ndarray
    potential: np.ndarray
    diverging: np.ndarray
    n_steps: np.ndarray
    acceptance: np.ndarray
    step_size: np.ndarray
    target_acceptance: float


def _kernel(problem: Sampled, whitening: Whitening, warmup: int, target):
    """Return NUTS' own init and step functions on standard coordinates."""
    init, step = hmc(
        lambda standard: potential(problem, whitening.position(standard)), algo="NUTS"
    )
    start = partial(
        init,
        num_warmup=warmup,
        target_accept_prob=target,
        max_tree_depth=MAX_TREE_DEPTH,
        trajectory_length=None,  # pyright: ignore[reportArgumentType]
    )
    return start, step


@jit(static_argnames=("warmup", "chains"))
def _start(problem, whitening, seed, chain, target, *, warmup, chains):
    """Return the state in which one of the chains starts, as its leaves."""
    own, _ = jax.random.split(jax.random.key(seed))
    place, walk = jax.random.split(jax.random.split(own, chains)[chain])
    spread = jax.random.normal(place, (len(whitening.factor),))
    start, _ = _kernel(problem, whitening, warmup, target)
    return jax.tree.leaves(start(_OVERDISPERSION * spread, rng_key=walk))


@jit(static_argnames=("warmup", "length"))
def _advance(problem, whitening, leaves, target, *, warmup, length):
    """Return the state of a chain after so many steps, and what is kept of each."""
    start, step = _kernel(problem, whitening, warmup, target)
    # The step function takes its settings from the last call of its init.
    structure = jax.tree.structure(start(jnp.zeros(len(whitening.factor))))

    def one(state, _):
        state = step(state)
        kept = (
            state.z,
            state.energy,
            state.potential_energy,
            state.diverging,
            state.num_steps,
            state.accept_prob,
            state.adapt_state.step_size,
        )
        return state, kept

    state = jax.tree.unflatten(structure, leaves)
    state, kept = jax.lax.scan(one, state, length=length)
    return jax.tree.leaves(state), kept


@jit
def _constrain(problem, whitening, standard, seed):
    _, own = jax.random.split(jax.random.key(seed))
    keys = jax.random.split(own, standard.shape[:2])

    def one(drawn):
        e, key = drawn
        named = values_at(problem, whitening.position(e))
        return named | draw_members(problem, named, key)

    # One draw after the other: side by side members by the thousand fill the memory.
    return jax.vmap(partial(jax.lax.map, one))((standard, keys))


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
    """Draw from the posterior.

    A run with divergent trajectories, or whose chains have not mixed, is thrown away
    whole and repeated with shorter steps. One that needs only more draws goes on, up to
    four times as long. What is returned is one run, with the faults that it still has.

    Args:
        problem: the inference problem.
        whitening: coordinates from `laplace.fit`.
        seed: the same one gives the same draws.
        chains: independent chains, one after the other in each stretch.
        warmup: iterations of adaptation per chain, discarded.
        draws: iterations kept per chain, or a multiple of them.
        progress: called after every stretch.
    """
    begin = partial(_Run, problem, whitening, seed, chains, warmup, progress)
    # Over bends long steps diverge: they are not even tried.
    *longer, shortest = TARGET_ACCEPTANCE[problem.bent :]
    for target in longer:
        run = begin(target)
        run.advance(draws, in_vain_if_diverging=True)
        if _sound(run.kept()):
            found = _gone_on(run, draws)
            if not found.diverging.any():
                return found
    run = begin(shortest)
    run.advance(draws)
    return _gone_on(run, draws)


def _gone_on(run: "_Run", draws: int) -> Draws:
    """Return the draws of a run, which goes on by so many while that mends it."""
    found = run.found()
    while found.energy.shape[1] < _LONGEST * draws and _too_few(found):
        run.advance(draws)
        found = run.found()
    return found


def _too_few(found: Draws) -> bool:
    """Tell whether more draws would mend a run, of ordinary length at least."""
    draws = found.energy.shape[1]
    if draws < _TELLING * ESS_PER_CHAIN or found.diverging.any():
        return False
    named = found.values.items()
    return not have_mixed({n: v for n, v in named if v.ndim == 2 and np.ptp(v) > 0.0})


def _sound(kept) -> bool:
    """Tell whether shorter steps would mend nothing."""
    standard, diverging = kept[0], kept[_DIVERGING]
    if diverging.any():
        return False
    # So few draws are no sign of the steps.
    few = standard.shape[1] < _TELLING * ESS_PER_CHAIN
    coordinates = np.moveaxis(standard, -1, 0)
    return few or have_mixed({str(i): x for i, x in enumerate(coordinates)})


class _Run:
    """All chains of one step size, which may go on."""

    def __init__(self, problem, whitening, seed, chains, warmup, progress, target):
        # Once, not at each stretch.
        self._model = jax.device_put((problem, whitening))
        self._seed = seed
        self._warmup, self._progress, self._target = warmup, progress, target
        size = {"warmup": warmup, "chains": chains}
        self._states = [
            _start(*self._model, seed, chain, target, **size) for chain in range(chains)
        ]
        self._done, self._kept = 0, []

    def advance(self, draws: int, *, in_vain_if_diverging: bool = False) -> None:
        """Draw so many more from each chain, after its warm-up.

        Args:
            draws: their number.
            in_vain_if_diverging: stop at the first trajectory that diverges.
        """
        warmup, total = self._warmup, max(self._done, self._warmup) + draws
        while self._done < total:
            # Stretches end with the warm-up, so that all but the last ones are alike.
            left = (warmup if self._done < warmup else total) - self._done
            size = {"warmup": warmup, "length": min(_STRETCH, left)}
            each = [
                _advance(*self._model, state, self._target, **size)
                for state in self._states
            ]
            self._states = [state for state, _ in each]
            kept = jax.device_get([kept for _, kept in each])
            if self._done >= warmup:
                self._kept.append([np.stack(part) for part in zip(*kept, strict=True)])
            self._done += size["length"]
            if self._progress is not None:
                self._progress(self._done, total)
            if in_vain_if_diverging and self._diverged():
                return

    def _diverged(self) -> bool:
        return bool(self._kept) and self._kept[-1][_DIVERGING].any()

    def kept(self) -> list[np.ndarray]:
        """Return what is kept of each draw, axes chain and draw first."""
        parts = zip(*self._kept, strict=True)
        return [np.concatenate(part, axis=1) for part in parts]

    def found(self) -> Draws:
        """Return the draws so far, with their parameters by name."""
        standard, *about = self.kept()
        values = _constrain(*self._model, standard, self._seed)
        named = {name: np.asarray(value) for name, value in values.items()}
        return Draws(named, *about, target_acceptance=self._target)


def check_settings(chains: int, warmup: int, draws: int, seed: int) -> None:
    """Check that a run is long enough for its own checks, and not endless.

    Raises:
        InputError: it is not.
    """
    given = {"chains": chains, "warmup": warmup, "draws": draws, "seed": seed}
    with Findings() as wrong:
        for name, value in given.items():
            wrong += implausible(name, value)
