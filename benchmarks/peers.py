"""Whole processes from a CSV file to a table of the posterior: hdcal and its peers.

The same model and priors, written as each tool's users write it: six parameters, a
straight line that softens with temperature, 4 chains of 1000 draws after 1000 of
warm-up. One run fills what caches a tool has; those after it count.
"""

import json
import math
import sys
import tempfile
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from statistics import median

from benchmarks.children import CASE, HDCAL, ask, run, table

DATA = CASE / "data.csv"
SAMPLED = {"chains": 4, "tune": 1000, "draws": 1000}


def hdcal(_: Path) -> None:
    """Also compares with the priors and checks the residuals."""
    import hdcal

    found = hdcal.calibrate(hdcal.read_case(CASE))
    for name, diagnosis in found.diagnoses.items():
        print(name, found.draws[name].mean(), diagnosis)


def numpyro(numbers: Path) -> None:
    import jax

    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
    import arviz_base
    import arviz_stats
    import numpyro.distributions as dist
    from numpyro import sample
    from numpyro.infer import MCMC, NUTS

    def model(about, deformation, force):
        law = {n: getattr(dist, kind)(*a) for n, (kind, *a) in about["priors"].items()}
        v = {name: sample(name, one) for name, one in law.items()}
        mean = _mean(v, about, deformation)
        sample("force", dist.Normal(mean, v["sigma"]), obs=force)

    kernel = NUTS(model)
    chains = MCMC(
        kernel,
        num_warmup=1000,
        num_samples=1000,
        num_chains=4,
        chain_method="vectorized",
        progress_bar=False,
    )
    chains.run(jax.random.key(0), *_read(numbers))
    print(arviz_stats.summary(arviz_base.from_numpyro(chains)))


def pymc(numbers: Path) -> None:
    import arviz_stats
    import pymc

    with _pymc_model(numbers):
        found = pymc.sample(**SAMPLED, cores=1, progressbar=False, random_seed=0)
    print(arviz_stats.summary(found))


def nutpie(numbers: Path) -> None:
    import arviz_stats
    import nutpie

    compiled = nutpie.compile_pymc_model(_pymc_model(numbers))
    found = nutpie.sample(compiled, **SAMPLED, progress_bar=False, seed=0)
    print(arviz_stats.summary(found))


def _pymc_model(numbers: Path):
    import pymc

    about, deformation, force = _read(numbers)
    with pymc.Model() as model:
        v = {
            name: getattr(pymc, kind)(name, *arguments)
            for name, (kind, *arguments) in about["priors"].items()
        }
        mean = _mean(v, about, deformation)
        pymc.Normal("force", mean, v["sigma"], observed=force)
    return model


def _read(numbers: Path):
    import pandas as pd

    rows = pd.read_csv(DATA)
    columns = (rows[name].to_numpy(float) for name in ("deformation_mm", "force_N"))
    return json.loads(numbers.read_text("utf-8")), *columns


def _mean(v: dict, about: dict, deformation):
    stiffness = v["K"] * v["E0"] * about["unit_stiffness"]
    warmer = 1.0 - v["alpha"] * about["temperature_rise"]
    offset = v["deformation_offset"]
    return stiffness * warmer * (deformation - offset) + v["force_offset"]


CONTENDERS: dict[str, tuple[str, Callable]] = {
    "hdcal": ("hdcal, library", hdcal),
    "numpyro": ("NumPyro NUTS", numpyro),
    "nutpie": ("PyMC's model by nutpie, numba", nutpie),
    "pymc": ("PyMC NUTS", pymc),
}


def main(repeats: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        numbers = scratch / "numbers.json"
        numbers.write_text(json.dumps(ask("peers", "priors")), "utf-8")
        cache = {
            "HDCAL_CACHE_DIR": scratch / "hdcal",
            "PYTENSOR_FLAGS": f"base_compiledir={scratch}/pytensor",
        }
        whole = (*HDCAL, "calibrate", CASE, "--out", scratch / "out", "--force")
        commands = {"hdcal calibrate, with figures and report": whole}
        for name, (words, _) in CONTENDERS.items():
            if find_spec(name):
                commands[words] = ("-m", "benchmarks.peers", name, numbers)
        found = {words: [] for words in commands}
        for _ in range(1 + repeats):
            for words, command in commands.items():
                found[words].append(run(*command, **cache))
        own = median(one.seconds for one in found["hdcal, library"][1:])
        heading = ("process", "first [s]", "warm [s]", "of hdcal's", "memory [MiB]")
        table(heading, (_line(words, runs, own) for words, runs in found.items()))


def _line(words: str, runs: list, own: float) -> tuple:
    first, *warm = runs
    seconds = median(one.seconds for one in warm)
    memory = max(one.peak_bytes for one in warm) / 2**20
    times = f"{first.seconds:.1f}", f"{seconds:.2f}", f"{seconds / own:.1f}"
    return words, *times, f"{memory:.0f}"


def priors() -> dict:
    """Return what hdcal takes for the case, as numbers."""
    from benchmarks.density import NAMES, SITES, make_problem

    problem, kinds = make_problem(), {"normal": "Normal", "lognormal": "LogNormal"}
    laws = {n: problem.priors[n] for n in (SITES.get(n, n) for n in NAMES)}
    return {
        "priors": {name: _law(kinds[p.family], p.numbers) for name, p in laws.items()},
        "unit_stiffness": float(problem.unit_stiffness),
        "temperature_rise": 0.0,
    }


def _law(kind: str, numbers) -> list:
    first, *others = map(float, numbers)
    return [kind, math.log(first) if kind == "LogNormal" else first, *others]


if __name__ == "__main__":
    if sys.argv[1] == "priors":
        print(json.dumps(priors()))
    else:
        CONTENDERS[sys.argv[1]][1](Path(sys.argv[2]))
