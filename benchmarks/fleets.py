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
CHAINS, WARMUP, DRAWS = 4, 500, 500
TRUTH = {"centre": 200.0, "gear": 1.0, "mounting": 0.6, "reading": 0.4}
ZERO, SHARE = 1.0, 0.9
# Half-normal but for the first two, which are lognormal and normal; as hdcal has them.
PRIORS = {
    "stiffness": (200.0, 0.1),
    "zero": (0.0, 5.0),
    "specimen_sd": 0.05,
    "run_offset_sd": 2.0,
    "sigma": 2.0,
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
    from numpyro import distributions as dist
    from numpyro.infer import MCMC, NUTS
    from numpyro.infer.reparam import LocScaleReparam

    npr.enable_x64()

    def model():
        at, spread = PRIORS["stiffness"]
        centre = npr.sample("stiffness", dist.LogNormal(np.log(at), spread))
        zero = npr.sample("zero", dist.Normal(*PRIORS["zero"]))
        sd = {
            name: npr.sample(name, dist.HalfNormal(PRIORS[name]))
            for name in ("specimen_sd", "run_offset_sd", "sigma")
        }
        gears = dist.Normal(centre, centre * sd["specimen_sd"])
        zeros = dist.Normal(zero, sd["run_offset_sd"])
        own = npr.sample("own", gears.expand([GEARS]))
        zeros = npr.sample("zeros", zeros.expand([GEARS * MOUNTINGS]))
        force = own[data["gear"]] * data["x"] + zeros[data["mounting"]]
        npr.sample("force", dist.Normal(force, sd["sigma"]), obs=data["force"])

    apart = {name: LocScaleReparam(1.0 if centred else 0.0) for name in ("own", "zeros")}
    mcmc = MCMC(
        NUTS(npr.handlers.reparam(model, apart)),
        num_warmup=WARMUP,
        num_samples=DRAWS,
        num_chains=CHAINS,
        chain_method=METHOD,
        progress_bar=False,
    )

    def fit(seed):
        mcmc.run(jax.random.key(seed))
        return _summary(mcmc.get_samples(group_by_chain=True))

    return fit
