"""Effective draws per second of hdcal's sampler and of others, on one density."""

import json
import sys
import tempfile
from pathlib import Path
from statistics import median

from benchmarks.children import ask, table

CONTENDERS = {
    "hdcal": "hdcal (NumPyro NUTS)",
    "blackjax": "BlackJAX NUTS",
    "nutpie": "nutpie, numba",
    "nutpie_jax": "nutpie, JAX",
    "pymc": "PyMC NUTS",
    "emcee": "emcee",
}
PROCESSES, HOT = 2, 5


def main(repeats: int) -> None:
    found = {name: [] for name in CONTENDERS}
    with tempfile.TemporaryDirectory() as folder:
        stored = Path(folder) / "numbers.npz"
        gap = ask("samplers", stored)["gap"]
        print(f"largest difference of the two log densities: {gap:.1e}\n")
        for turn in range(PROCESSES):
            for name in CONTENDERS:
                # PyTensor keeps what it compiled: an empty folder for each process.
                flags = f"base_compiledir={folder}/{name}-{turn}"
                said = ask(
                    "contenders", name, stored, max(repeats, HOT), PYTENSOR_FLAGS=flags
                )
                found[name].append(said)
    lines = [_line(name, runs, found["hdcal"]) for name, runs in found.items()]
    heading = ("sampler", "least ESS", "hot [s]", "hot ESS/s", "of hdcal's")
    table((*heading, "first call [s]", "first ESS/s", "of hdcal's"), lines)


def _line(name: str, runs: list[dict], own: list[dict]) -> tuple:
    hot, first = _rate(runs, slice(1, None)), _rate(runs, slice(0, 1))
    own_hot, own_first = _rate(own, slice(1, None)), _rate(own, slice(0, 1))
    ess = median(size for run in runs for size in run["ess"])
    return (
        CONTENDERS[name],
        f"{ess:.0f}",
        f"{hot[0]:.3f}",
        f"{hot[1]:.0f}",
        f"{hot[1] / own_hot[1]:.2f}",
        f"{first[0]:.1f}",
        f"{first[1]:.0f}",
        f"{first[1] / own_first[1]:.2f}",
    )


def _rate(runs: list[dict], part: slice) -> tuple[float, float]:
    """Return the median time of calls, and their median ESS per second."""
    seconds = [s for run in runs for s in run["seconds"][part]]
    sizes = [size for run in runs for size in run["ess"][part]]
    rates = [size / s for size, s in zip(sizes, seconds, strict=True)]
    return median(seconds), median(rates)


if __name__ == "__main__":
    from benchmarks.density import make_numbers

    numbers, largest = make_numbers()
    numbers.save(Path(sys.argv[1]))
    print(json.dumps({"gap": largest}))
