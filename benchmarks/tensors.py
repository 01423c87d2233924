"""The samplers that take a PyMC model: PyMC's own NUTS, and nutpie."""

import os

import numpy as np

from benchmarks.density import CHAINS, DRAWS, NAMES, WARMUP, log_density


def _pymc_model(numbers):
    import pymc
    import pytensor.tensor

    with pymc.Model() as model:
        e = pymc.Flat("e", shape=len(NAMES))
        pymc.Potential("density", log_density(e, numbers, pytensor.tensor))
    point = np.linspace(-1.0, 1.0, len(NAMES))
    gap = model.compile_logp()({"e": point}) - log_density(point, numbers, np)
    if not abs(gap) < 1e-8:
        raise RuntimeError(f"PyMC's density is off by {gap}")
    return model


def _nutpie(numbers, **settings):
    import nutpie

    compiled = nutpie.compile_pymc_model(_pymc_model(numbers), **settings)

    def draw(seed):
        found = nutpie.sample(
            compiled,
            chains=CHAINS,
            tune=WARMUP,
            draws=DRAWS,
            cores=os.cpu_count(),
            seed=seed,
            save_warmup=False,
            progress_bar=False,
        )
        return found.posterior["e"].to_numpy()

    return draw


def nutpie(numbers):
    return _nutpie(numbers, backend="numba")


def nutpie_jax(numbers):
    return _nutpie(numbers, backend="jax", gradient_backend="jax")


def pymc(numbers):
    import pymc

    model = _pymc_model(numbers)

    def draw(seed):
        with model:
            found = pymc.sample(
                tune=WARMUP,
                draws=DRAWS,
                chains=CHAINS,
                # One after the other: starting workers takes longer than sampling.
                cores=1,
                random_seed=seed,
                progressbar=False,
                compute_convergence_checks=False,
            )
        return found.posterior["e"].to_numpy()

    return draw
