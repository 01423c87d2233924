"""Importing hdcal changes no global state; its first arrays are in double precision."""

import base64
import os
import pickle
import subprocess
import sys

import pytest
from slices import slice_of

import hdcal

# Packages with global state of their own are imported first.
IMPORTS = """
import os, pkgutil, sys, warnings
from importlib import import_module

import hdcal
assert not {"jax", "numpy", "equinox"} & set(sys.modules)

import arviz_base, arviz_stats, diffrax, distributed, equinox, h5netcdf, jax
import matplotlib, numpy, numpyro.contrib.hsgp.laplacian, optimistix, pandas
import pydantic, rich, scipy.optimize, scipy.stats, threadpoolctl, xarray

def state():
    return {
        "jax": dict(jax.config.values),
        "double": jax.config.jax_enable_x64,
        "warnings": list(warnings.filters),
        "environment": dict(os.environ),
        "errors": numpy.geterr(),
        "print": numpy.get_printoptions(),
        "figures": dict(matplotlib.rcParams),
        "hook": sys.excepthook,
    }

before = state()
for name in hdcal.__all__:
    getattr(hdcal, name)
for module in pkgutil.walk_packages(hdcal.__path__, "hdcal."):
    import_module(module.name)
for name, value in state().items():
    assert value == before[name], name
# The comparison notices a change.
jax.config.update("jax_enable_x64", True)
os.environ["XLA_FLAGS"] = ""
assert all(state()[name] != before[name] for name in ("double", "environment"))
"""
# Too late for double precision.
WITHIN = """
import hdcal, jax

def force(wall):
    return hdcal.force(hdcal.Geometry(wall, 40.0, 70.0, 70.0, 0.3), 210e3, 0.1, 0.3)

def small(wall):
    return wall * hdcal.Geometry(0.68, 40.0, 70.0, 70.0, 0.3).radius

for late in (jax.grad(force), jax.jit(force), jax.jit(small)):
    try:
        late(0.68)
    except RuntimeError as error:
        assert "jax_enable_x64" in str(error)
    else:
        raise AssertionError("single precision")
jax.config.update("jax_enable_x64", True)
found = jax.jit(jax.grad(force))(0.68)
assert found.dtype == "float64"
assert abs(float(found) * 0.68 / (3.0 * float(force(0.68))) - 1.0) < 1e-14
"""
GEAR = "import hdcal, jax; gear = hdcal.Geometry(0.68, 40.0, 70.0, 70.0, 0.3)\n"
FIRST_ARRAYS = {
    "compiled force": GEAR + "found = jax.jit(hdcal.force)(gear, 210e3, 0.1, 0.3)",
    "array from before": """
import jax.numpy as jnp
deformation = jnp.linspace(0.1, 0.5, 5)
assert deformation.dtype == jnp.float32
"""
    + GEAR
    + "found = hdcal.force(gear, 210e3, 0.1, deformation)",
    "gear from another process": """
import base64, os, pickle, jax
gear = pickle.loads(base64.b64decode(os.environ["SENT"]))
assert jax.config.jax_enable_x64
from hdcal.physics.theory import THEORIES
found = THEORIES["cup"](gear, 210e3)
""",
}


def run(code: str, **environment) -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        capture_output=True,
        text=True,
        env={k: v for k, v in os.environ.items() if not k.startswith("JAX_")}
        | environment,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.thorough
def test_no_import_changes_state_or_makes_an_array():
    # Without a platform any array is an error.
    run(IMPORTS, JAX_PLATFORMS="none_such")


@pytest.mark.parametrize("first", slice_of(FIRST_ARRAYS, ["compiled force"]))
def test_first_arrays_are_in_double_precision(first: str):
    gear = hdcal.Geometry(0.68, 40.0, 70.0, 70.0, 0.3)
    check = "\nassert found.dtype == 'float64', found.dtype"
    sent = base64.b64encode(pickle.dumps(gear)).decode()
    run(FIRST_ARRAYS[first] + check, SENT=sent)


def test_a_first_gear_within_compiled_code_is_refused():
    run(WITHIN)
