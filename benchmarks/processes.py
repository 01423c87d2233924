"""Whole processes of hdcal against importing what a calibration imports."""

import tempfile
from pathlib import Path
from statistics import median

from benchmarks.children import CASE, HDCAL, run, table

# What src/hdcal imports by name, and what a calibration loads through it: the netCDF
# engine of xarray and the canvases of Matplotlib.
_NAMES = """
click rich.box rich.console rich.padding rich.table rich.text platformdirs
numpy scipy.linalg scipy.optimize scipy.stats pandas pint pydantic
jax jax.flatten_util jax.nn jax.numpy jax.scipy.linalg jax.scipy.special
jaxtyping equinox numpyro numpyro.distributions numpyro.infer.hmc numpyro.infer.util
numpyro.contrib.hsgp.laplacian numpyro.contrib.hsgp.spectral_densities
xarray h5netcdf arviz_base arviz_stats jinja2
matplotlib.axes matplotlib.colors matplotlib.figure matplotlib.font_manager
matplotlib.legend_handler matplotlib.lines matplotlib.patches
matplotlib.backends.backend_agg matplotlib.backends.backend_svg
"""
IMPORTS = ("-c", "\n".join(f"import {name}" for name in _NAMES.split()))


def main(repeats: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        calibrate = (*HDCAL, "calibrate", CASE, "--out", scratch / "out", "--force")
        warm = scratch / "warm"
        run(*IMPORTS)
        run(*calibrate, HDCAL_CACHE_DIR=warm)
        seconds = {"import": [], "help": [], "warm": [], "cold": []}
        for turn in range(repeats):
            seconds["import"].append(run(*IMPORTS).seconds)
            seconds["help"].append(run(*HDCAL, "--help").seconds)
            seconds["warm"].append(run(*calibrate, HDCAL_CACHE_DIR=warm).seconds)
            # Compiling is long and steady: three times will do.
            if turn < 3:
                cold = scratch / f"cold-{turn}"
                seconds["cold"].append(run(*calibrate, HDCAL_CACHE_DIR=cold).seconds)
    middle = {name: median(values) for name, values in seconds.items()}
    words = {
        "import": ("import of the dependencies", ""),
        "help": ("`hdcal --help`", "≤ 0.3"),
        "warm": ("`hdcal calibrate`, warm", "≤ 2.5"),
        "cold": ("`hdcal calibrate`, empty compilation cache", "≤ 8"),
    }
    table(
        ("process", "median [s]", "fastest … slowest [s]", "ratio", "wanted"),
        [
            (
                words[name][0],
                f"{middle[name]:.2f}",
                f"{min(values):.2f} … {max(values):.2f}",
                f"{middle[name] / middle['import']:.2f}",
                words[name][1],
            )
            for name, values in seconds.items()
        ],
    )
