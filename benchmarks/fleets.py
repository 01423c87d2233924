"""A fleet of 300 gears, by hdcal.fleet, by NUTS on every gear, and by REML.

The data are straight lines in plain NumPy: gears scatter about a centre, zeros of
mountings about their mean, and readings about the line of their mounting. Every
contender has this model; hdcal's allows besides that gears are off and that their
noise differs. NUTS samples each gear and each mounting, non-centred and centred, under
hdcal's priors of the population. REML takes no priors; what its reading sd is known to
is that of a variance of as many degrees of freedom as lines leave.

A process fits twice, each time with another seed; the second fit is the hot one, and
is not counted in the whole process. NUTS is measured once, whatever `--repeats` says.
`python -m benchmarks.fleets off` makes one of the gears 10 % soft, which only hdcal's
model allows for; `uneven` takes away three readings in ten at random and the second
mounting of every third gear, for hdcal and REML.
"""

import json
import sys
import tempfile
import time
from functools import partial
from importlib.util import find_spec
from statistics import median
from typing import Any

import numpy as np

from benchmarks.children import CASE, Run, run, table

GEARS, MOUNTINGS, ROWS, SEED = 300, 2, 16, 20261127
SHAPE = (GEARS, MOUNTINGS, ROWS)
CHAINS, WARMUP, DRAWS = 4, 500, 500
CENTRE, GEAR, ZERO, MOUNTING, READING = 200.0, 0.01, 1.0, 0.6, 0.4
SHARE, KEPT = 0.9, 0.7
Data = dict[str, np.ndarray]
# About hdcal's, in NumPyro's words.
PRIORS = {
    "stiffness": ("LogNormal", 5.07, 0.46),
    "zero": ("Normal", 0.0, 5.8),
    "specimen_sd": ("HalfNormal", 0.09),
    "run_offset_sd": ("HalfNormal", 1.95),
    "sigma": ("LogNormal", -0.72, 1.6),
}
HEADING = ("fit", "whole process [s]", "hot [s]", "least ESS", "centre [N/mm] (200)")
HEADING += ("gear sd [%] (1)", "mounting sd [N] (0.6)", "reading sd [N] (0.4)")


def main(repeats: int, *variant: str) -> None:
    print(" ".join([f"{GEARS} gears", *variant]) + "; in brackets the truth\n")
    # Arrays of a fixed shape are what NumPyro is given.
    names = [n for n in CONTENDERS if "uneven" not in variant or "NumPyro" not in n]
    found = {n: [] for n in names if find_spec(CONTENDERS[n][1])}
    with tempfile.TemporaryDirectory() as folder:
        kept = {"JAX_COMPILATION_CACHE_DIR": folder}
        kept |= {"JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0"}
        for turn in range(repeats + 1):
            for name, runs in found.items():
                # The first process fills the cache; NUTS on every gear takes long.
                if turn < 2 or "NUTS" not in name:
                    part = ("-m", "benchmarks.fleets", name, turn, *variant)
                    runs.append(run(*part, **kept))
    none = ("not installed", *["–"] * (len(HEADING) - 2))
    rows = ((n, *(_line(found[n][1:]) if n in found else none)) for n in names)
    table(HEADING, rows)


def _line(runs: list[Run]) -> tuple[str, ...]:
    said = [json.loads(r.output.splitlines()[-1]) for r in runs]
    hot = [s["hot"] for s in said]
    whole = median(r.seconds - h for r, h in zip(runs, hot, strict=True))
    return (
        f"{whole:.1f}",
        f"{median(hot):.2f} ({min(hot):.2f} … {max(hot):.2f})",
        f"{min(s['ess'] for s in said):.0f}" if said[0]["ess"] else "–",
        *(f"{mean:.4g} ± {sd:.2g}" for mean, sd in said[-1]["answers"]),
    )


def simulate(variant: str = "") -> Data:
    """Return the readings: gear, mounting (of all), deformation and force."""
    rng = np.random.default_rng(SEED)
    own = 1.0 + GEAR * rng.standard_normal(GEARS)
    own[GEARS // 2] *= SHARE if variant == "off" else 1.0
    zero = ZERO + MOUNTING * rng.standard_normal(GEARS * MOUNTINGS)
    mounting = np.repeat(np.arange(GEARS * MOUNTINGS), ROWS)
    gear, x = mounting // MOUNTINGS, np.tile(np.linspace(0.02, 0.48, ROWS), len(zero))
    noise = READING * rng.standard_normal(len(x))
    force = CENTRE * own[gear] * x + zero[mounting] + noise
    data = {"gear": gear, "mounting": mounting, "x": x, "force": force}
    if variant != "uneven":
        return data
    once = (gear % 3 == 0) & (mounting % MOUNTINGS > 0)
    kept = ~once & (rng.random(len(x)) < KEPT)
    return {name: column[kept] for name, column in data.items()}


def hdcal(data: Data):
    import pandas as pd

    from hdcal import fleet

    names = {"gear": "specimen", "mounting": "run", "x": "deformation_mm"}
    frame = pd.DataFrame(data).rename(columns={**names, "force": "force_N"})
    gear = CASE.parent / "fleet-demo" / "gear.toml"

    def fit(seed):
        draws = fleet(frame, gear, seed=seed).draws
        return _summary({name: draws[name].reshape(CHAINS, -1) for name in PRIORS})

    return fit


def numpyro(data: Data, centred=False):
    import jax
    import numpyro as npr
    import numpyro.distributions as dist
    from numpyro.infer import MCMC, NUTS

    npr.enable_x64()
    x, force = (data[name].reshape(SHAPE) for name in ("x", "force"))

    def scattered(name, centre, sd, size) -> Any:
        if centred:
            return npr.sample(name, dist.Normal(centre, sd).expand(size))
        return centre + sd * npr.sample(name, dist.Normal().expand(size))

    def model():
        p: dict[str, Any] = {
            name: npr.sample(name, getattr(dist, family)(*numbers))
            for name, (family, *numbers) in PRIORS.items()
        }
        spread = p["stiffness"] * p["specimen_sd"]
        own: Any = scattered("own", p["stiffness"], spread, SHAPE[:1])
        zeros: Any = scattered("zeros", p["zero"], p["run_offset_sd"], SHAPE[:2])
        line = own[:, None, None] * x + zeros[:, :, None]
        npr.sample("force", dist.Normal(line, p["sigma"]), obs=force)

    size: Any = {"num_warmup": WARMUP, "num_samples": DRAWS, "num_chains": CHAINS}
    mcmc = MCMC(NUTS(model), **size, chain_method="sequential", progress_bar=False)

    def fit(seed):
        mcmc.run(jax.random.key(seed))
        return _summary(mcmc.get_samples(group_by_chain=True))

    return fit


def nutpie(data: Data):
    import nutpie as sampler  # pyright: ignore[reportMissingImports]
    import pymc as pm  # pyright: ignore[reportMissingImports]

    gear, mounting = data["gear"], data["mounting"]
    with pm.Model() as model:
        p = {
            name: getattr(pm, family)(name, *numbers)
            for name, (family, *numbers) in PRIORS.items()
        }
        own = p["stiffness"] * (1.0 + p["specimen_sd"] * pm.Normal("own", shape=GEARS))
        mounted = pm.Normal("zeros", shape=GEARS * MOUNTINGS)
        line = own[gear] * data["x"]
        line += (p["zero"] + p["run_offset_sd"] * mounted)[mounting]
        pm.Normal("force", line, p["sigma"], observed=data["force"])
    compiled = sampler.compile_pymc_model(model)
    size = {"tune": WARMUP, "draws": DRAWS, "chains": CHAINS, "progress_bar": False}

    def fit(seed):
        drawn = sampler.sample(compiled, seed=seed, **size).posterior
        return _summary({name: drawn[name].to_numpy() for name in PRIORS})

    return fit


def statsmodels(data: Data):
    import pandas as pd
    from statsmodels.api import MixedLM  # pyright: ignore[reportMissingImports]

    frame = pd.DataFrame(data)
    # Within a gear: columns of other gears' mountings would be noughts.
    frame["mounting"] %= MOUNTINGS
    form = {"re_formula": "0 + x", "vc_formula": {"mounting": "0 + C(mounting)"}}
    left = len(frame) - GEARS - len(np.unique(data["mounting"]))

    def fit(_):
        model = MixedLM.from_formula("force ~ x", frame, groups="gear", **form)
        found = model.fit(reml=True)
        if not found.converged:
            raise RuntimeError("REML did not converge")
        centre, sigma = found.fe_params["x"], np.sqrt(found.scale)
        # Variances, and what they are known to, are told in that of readings.
        ratio = np.sqrt(found.params[["x Var", "mounting Var"]].to_numpy())
        error = found.bse[["x Var", "mounting Var"]].to_numpy() / (2.0 * ratio)
        means = (centre, sigma * ratio[0] / centre * 100.0, sigma * ratio[1], sigma)
        sds = (sigma * error[0] / centre * 100.0, sigma * error[1])
        sds = (found.bse_fe["x"], *sds, sigma / np.sqrt(2.0 * left))
        return {"ess": None, "answers": list(zip(means, sds, strict=True))}

    return fit


def _summary(draws: dict[str, Any]) -> dict:
    from arviz_stats.base import array_stats as stats  # pyright: ignore

    sizes: Any = [stats.ess(draws[n], chain_axis=0, draw_axis=1) for n in PRIORS]
    draws = draws | {"specimen_sd": 100.0 * draws["specimen_sd"]}
    told = [draws[name] for name in PRIORS if name != "zero"]
    answers = [(float(np.mean(v)), float(np.std(v))) for v in told]
    return {"ess": float(min(map(float, sizes))), "answers": answers}


# What each one is called, how it is prepared, and what has to be installed.
CONTENDERS = {
    "hdcal.fleet": (hdcal, "hdcal"),
    "NumPyro NUTS, non-centred": (numpyro, "numpyro"),
    "NumPyro NUTS, centred": (partial(numpyro, centred=True), "numpyro"),
    "PyMC with nutpie, NUTS, non-centred": (nutpie, "nutpie"),
    "statsmodels MixedLM, REML": (statsmodels, "statsmodels"),
}


def measure(name: str, turn: int, variant: str = "") -> dict:
    """Fit, and but for the first turn once more, hot."""
    fit = CONTENDERS[name][0](simulate(variant))
    found = fit(2 * turn)
    began = time.perf_counter()
    if turn:
        found = fit(2 * turn + 1)
    return {"hot": time.perf_counter() - began, **found}


if __name__ == "__main__":
    if sys.argv[1:] in ([], ["off"], ["uneven"]):
        main(3, *sys.argv[1:])
    else:
        print(json.dumps(measure(sys.argv[1], int(sys.argv[2]), *sys.argv[3:])))
