"""A fleet of 300 gears, by hdcal.fleet, by NUTS on every gear, and by REML.

The data are straight lines in plain NumPy: gears scatter about a centre, zeros of
mountings about their mean, and readings about the line of their mounting. Every
contender has this model; hdcal's allows besides that gears are off and that their
noise differs. NUTS samples each gear and each mounting, non-centred and centred, under
hdcal's priors of the population. REML takes no priors; what its reading sd is known to
is that of a variance of as many degrees of freedom as lines leave.

`python -m benchmarks.fleets off` makes one of the gears 10 % soft, which only hdcal's
model allows for.
"""

import json
import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path
from statistics import median

import numpy as np

from benchmarks.children import CASE, run, table

GEARS, MOUNTINGS, ROWS, SEED = 300, 2, 16, 20261127
import os
METHOD=os.environ.get('METHOD','vectorized')
CHAINS, WARMUP, DRAWS = 4, 500, 500
TRUTH = {"centre": 200.0, "gear": 1.0, "mounting": 0.6, "reading": 0.4}
ZERO, SHARE = 1.0, 0.9
# About hdcal's, in NumPyro's and PyMC's words alike.
PRIORS = {
    "stiffness": ("LogNormal", 5.07, 0.46),
    "zero": ("Normal", 0.0, 5.8),
    "specimen_sd": ("HalfNormal", 0.09),
    "run_offset_sd": ("HalfNormal", 1.95),
    "sigma": ("LogNormal", -0.72, 1.6),
}
HEADING = (
    "fit",
    "whole process [s]",
    "hot [s]",
    "least ESS",
    f"centre [N/mm] ({TRUTH['centre']:g})",
    f"gear sd [%] ({TRUTH['gear']:g})",
    f"mounting sd [N] ({TRUTH['mounting']:g})",
    f"reading sd [N] ({TRUTH['reading']:g})",
)


def simulate(off: bool) -> dict[str, np.ndarray]:
    """Return the readings: gear, mounting (of all), deformation and force."""
    rng = np.random.default_rng(SEED)
    own = 1.0 + 0.01 * TRUTH["gear"] * rng.standard_normal(GEARS)
    own[GEARS // 2] *= SHARE if off else 1.0
    zero = ZERO + TRUTH["mounting"] * rng.standard_normal(GEARS * MOUNTINGS)
    mounting = np.repeat(np.arange(GEARS * MOUNTINGS), ROWS)
    gear, x = mounting // MOUNTINGS, np.tile(np.linspace(0.02, 0.48, ROWS), len(zero))
    noise = TRUTH["reading"] * rng.standard_normal(len(x))
    force = TRUTH["centre"] * own[gear] * x + zero[mounting] + noise
    return {"gear": gear, "mounting": mounting, "x": x, "force": force}


def hdcal(data):
    import pandas as pd

    from hdcal import fleet

    names = {"gear": "specimen", "mounting": "run", "x": "deformation_mm"}
    frame = pd.DataFrame(data).rename(columns={**names, "force": "force_N"})
    gear = CASE.parent / "fleet-demo" / "gear.toml"

    def fit(seed):
        draws = fleet(frame, gear, seed=seed).draws
        return _summary({name: draws[name].reshape(CHAINS, -1) for name in PRIORS})

    return fit


def numpyro(data, centred=False):
    import jax
    import numpyro as npr
    import numpyro.distributions as dist
    from numpyro.infer import MCMC, NUTS

    npr.enable_x64()

    def scattered(name, centre, sd, size):
        if centred:
            return npr.sample(name, dist.Normal(centre, sd).expand([size]))
        return centre + sd * npr.sample(name, dist.Normal().expand([size]))

    def model():
        p = {
            name: npr.sample(name, getattr(dist, family)(*numbers))
            for name, (family, *numbers) in PRIORS.items()
        }
        spread = p["stiffness"] * p["specimen_sd"]
        own = scattered("own", p["stiffness"], spread, GEARS)
        count = GEARS * MOUNTINGS
        zeros = scattered("zeros", p["zero"], p["run_offset_sd"], count)
        line = own[data["gear"]] * data["x"] + zeros[data["mounting"]]
        npr.sample("force", dist.Normal(line, p["sigma"]), obs=data["force"])

    size = {"num_warmup": WARMUP, "num_samples": DRAWS, "num_chains": CHAINS}
    method = {"chain_method": METHOD, "progress_bar": False}
    mcmc = MCMC(NUTS(model), **size, **method)

    def fit(seed):
        mcmc.run(jax.random.key(seed))
        return _summary(mcmc.get_samples(group_by_chain=True))

    return fit


def pymc(data, centred=False):
    import pymc as pm  # pyright: ignore[reportMissingImports]

    def scattered(name, centre, sd, size):
        if centred:
            return pm.Normal(name, centre, sd, shape=size)
        return centre + sd * pm.Normal(name, shape=size)

    with pm.Model() as model:
        p = {
            name: getattr(pm, family)(name, *numbers)
            for name, (family, *numbers) in {
                k: (v[0], *v[1:]) for k, v in PRIORS.items()
            }.items()
        }
        spread = p["stiffness"] * p["specimen_sd"]
        own = scattered("own", p["stiffness"], spread, GEARS)
        count = GEARS * MOUNTINGS
        zeros = scattered("zeros", p["zero"], p["run_offset_sd"], count)
        line = own[data["gear"]] * data["x"] + zeros[data["mounting"]]
        pm.Normal("force", line, p["sigma"], observed=data["force"])

    def fit(seed):
        size = {"tune": WARMUP, "draws": DRAWS, "chains": CHAINS}
        with model:
            found = pm.sample(
                **size, random_seed=seed, progressbar=False, compute_convergence_checks=False
            )
        return _summary({name: found.posterior[name].to_numpy() for name in PRIORS})

    return fit


def statsmodels(data):
    import pandas as pd
    from statsmodels.regression.mixed_linear_model import (  # pyright: ignore[reportMissingImports]
        MixedLM,
    )

    frame = pd.DataFrame(data)
    # Within a gear: columns of other gears' mountings would be noughts.
    frame["mounting"] %= MOUNTINGS
    form = {"re_formula": "0 + x", "vc_formula": {"mounting": "0 + C(mounting)"}}
    left = len(frame) - GEARS * (1 + MOUNTINGS)

    def fit(_):
        model = MixedLM.from_formula("force ~ x", frame, groups="gear", **form)
        found = model.fit(reml=True)
        if not found.converged:
            raise RuntimeError("REML did not converge")
        centre, sigma = found.fe_params["x"], np.sqrt(found.scale)
        # Variances, and what they are known to, are told in that of readings.
        gear, mounting = (
            (sigma * np.sqrt(v), sigma * e / (2.0 * np.sqrt(v)))
            for v, e in zip(found.params[-2:], found.bse[-2:], strict=True)
        )
        answers = {
            "centre": (centre, found.bse_fe["x"]),
            "gear": tuple(100.0 * g / centre for g in gear),
            "mounting": mounting,
            "reading": (sigma, sigma / np.sqrt(2.0 * left)),
        }
        return {"ess": None, "answers": answers}

    return fit


def _summary(draws) -> dict:
    """Return mean and sd of what is compared, and the least bulk ESS of the population."""
    from arviz_stats.base import array_stats

    sizes = [array_stats.ess(draws[n], chain_axis=0, draw_axis=1) for n in PRIORS]
    told = {
        "centre": draws["stiffness"],
        "gear": 100.0 * draws["specimen_sd"],
        "mounting": draws["run_offset_sd"],
        "reading": draws["sigma"],
    }
    answers = {name: (float(np.mean(v)), float(np.std(v))) for name, v in told.items()}
    return {"ess": float(min(map(float, sizes))), "answers": answers}


# What each one is called, how it is prepared, and what has to be installed.
CONTENDERS = {
    "hdcal": ("hdcal.fleet", hdcal, "hdcal"),
    "numpyro": ("NumPyro NUTS, non-centred", numpyro, "numpyro"),
    "numpyro_centred": (
        "NumPyro NUTS, centred", lambda data: numpyro(data, True), "numpyro"
    ),
    "pymc": ("PyMC NUTS, non-centred", pymc, "pymc"),
    "pymc_centred": ("PyMC NUTS, centred", lambda data: pymc(data, True), "pymc"),
    "statsmodels": ("statsmodels MixedLM, REML", statsmodels, "statsmodels"),
}


def measure(name: str, calls: int, off: bool) -> dict:
    """Fit over and over in this process; imports are not counted here."""
    fit, seconds, found = CONTENDERS[name][1](simulate(off)), [], {}
    for seed in range(calls):
        began = time.perf_counter()
        found = fit(seed)
        seconds.append(time.perf_counter() - began)
    return {"seconds": seconds, **found}


if __name__ == "__main__":
    print(json.dumps(measure(sys.argv[1], int(sys.argv[2]), "off" in sys.argv)))
