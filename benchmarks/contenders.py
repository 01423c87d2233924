"""One sampler in a process of its own: the first call, then hot ones.

Each contender prepares and returns a function of a seed that returns draws, (chain,
draw, 6), in standard coordinates. The first call counts with the preparation, so it
holds all that is compiled; imports are not counted. All but hdcal get the whitening
for nothing.
"""

import json
import sys
import time
from importlib import import_module
from pathlib import Path

import numpy as np

from benchmarks.density import (
    CHAINS,
    DRAWS,
    NAMES,
    WARMUP,
    Numbers,
    least_ess,
    log_density,
    make_problem,
    named,
)
from benchmarks.tensors import nutpie, nutpie_jax, pymc

# Chains of the JAX samplers start as far apart as hdcal's.
OVERDISPERSION = 2.0
WALKERS, BURN_IN, STEPS = 32, 500, 4000


def hdcal(numbers):

    from hdcal.inference import laplace
    from hdcal.inference.sample import sample

    problem = make_problem()
    whitening = laplace.fit(problem)
    return lambda seed: sample(problem, whitening, seed).values


def blackjax(numbers):
    import blackjax
    import jax

    from hdcal.inference import laplace

    problem = make_problem()
    centre = dict(zip(NAMES, numbers.centre, strict=True))
    whitening = laplace.Whitening(centre, numbers.factor)

    def log_posterior(e):
        return -laplace.potential(problem, whitening.position(e))

    def chain(key):
        place, warm, walk = jax.random.split(key, 3)
        start = OVERDISPERSION * jax.random.normal(place, (len(NAMES),))
        adapt = blackjax.window_adaptation(blackjax.nuts, log_posterior)
        (state, settings), _ = adapt.run(warm, start, WARMUP)
        step = blackjax.nuts(log_posterior, **settings).step

        def one(state, key):
            state, _ = step(key, state)
            return state, state.position

        return jax.lax.scan(one, state, jax.random.split(walk, DRAWS))[1]

    chains = jax.jit(jax.vmap(chain))
    return lambda seed: np.asarray(
        chains(jax.random.split(jax.random.key(seed), CHAINS))
    )


def emcee(numbers):
    import emcee

    def log_posterior(points):
        return log_density(points, numbers, np)

    def draw(seed):
        start = np.random.default_rng(seed).normal(size=(WALKERS, len(NAMES)))
        walk = emcee.EnsembleSampler(WALKERS, len(NAMES), log_posterior, vectorize=True)
        walk.random_state = np.random.RandomState(seed).get_state()
        walk.run_mcmc(start, BURN_IN + STEPS)
        return walk.get_chain(discard=BURN_IN).swapaxes(0, 1)

    return draw


# The sampler, and what its process has to import beside it.
CONTENDERS = {
    "hdcal": (hdcal, "hdcal.inference.sample"),
    "blackjax": (blackjax, "blackjax"),
    "nutpie": (nutpie, "nutpie pymc numba"),
    "nutpie_jax": (nutpie_jax, "nutpie pymc jax"),
    "pymc": (pymc, "pymc"),
    "emcee": (emcee, "emcee"),
}


def measure(name: str, numbers: Numbers, repeats: int) -> dict:
    prepare, modules = CONTENDERS[name]
    for module in modules.split():
        import_module(module)
    began = time.perf_counter()
    draw = prepare(numbers)
    draws = draw(0)
    whole = time.perf_counter() - began
    runs = [(whole, draws)]
    for seed in range(1, repeats + 1):
        began = time.perf_counter()
        draws = draw(seed)
        runs.append((time.perf_counter() - began, draws))
    sizes = [
        least_ess(found if isinstance(found, dict) else named(found, numbers))
        for _, found in runs
    ]
    return {"seconds": [seconds for seconds, _ in runs], "ess": sizes}


if __name__ == "__main__":
    given = Numbers.load(Path(sys.argv[2]))
    print(json.dumps(measure(sys.argv[1], given, int(sys.argv[3]))))
