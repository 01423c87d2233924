"""Importing hdcal changes no global state; its first arrays are in double precision."""

import base64
import os
import pickle
import subprocess
import sys

import pytest
from slices import slice_of

import hdcal

# Without a platform the first array, made by whomever, is an error.
NO_ARRAYS = {"JAX_PLATFORMS": "none_such"}
# What hdcal imports has global state of its own: it is imported first.
STATE = """
import os, pkgutil, sys, warnings
from importlib import import_module

import arviz_base, arviz_stats, diffrax, distributed, equinox, h5netcdf, jax
import matplotlib, numpy, numpyro.contrib.hsgp.laplacian, optimistix, pandas
import pydantic, rich, scipy.optimize, scipy.stats, threadpoolctl, xarray

def state():
    return {
        "jax": dict(jax.config.values),
        "double": jax.config.jax_enable_x64,
        "cache": jax.config.jax_compilation_cache_dir,
        "warnings": list(warnings.filters),
        "environment": dict(os.environ),
        "errors": numpy.geterr(),
        "print": numpy.get_printoptions(),
        "figures": dict(matplotlib.rcParams),
        "hook": sys.excepthook,
    }

before = state()
"""
TOUCH = """
import hdcal
for name in hdcal.__all__:
    getattr(hdcal, name)
for module in pkgutil.walk_packages(hdcal.__path__, "hdcal."):
    import_module(module.name)
for name, value in state().items():
    assert value == before[name], name
assert not jax.config.jax_enable_x64
assert jax.config.jax_compilation_cache_dir is None
"""
# What must be seen, each with what would not have been seen before it.
PLANTED = """
for change in (
    "jax.config.update('jax_enable_x64', True)",
    "jax.config.update('jax_compilation_cache_dir', 'somewhere')",
    "warnings.simplefilter('ignore')",
    "os.environ['XLA_FLAGS'] = ''",
):
    exec(change)
    assert state() != before, change
    before = state()
try:
    jax.numpy.zeros(1)
except RuntimeError:
    pass
else:
    raise AssertionError("an array was made")
"""
UNLOADED = """
import sys, hdcal
assert not {"jax", "numpy", "equinox"} & set(sys.modules)
"""
# Too late to be in double precision, and said so.
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
GEAR = "import hdcal; gear = hdcal.Geometry(0.68, 40.0, 70.0, 70.0, 0.3)\n"
FIRST_ARRAYS = {
    "the force, compiled before anything else": GEAR
    + """
import jax
from hdcal.physics.theory import THEORIES
found = jax.jit(hdcal.force)(gear, 210e3, 0.1, 0.3)
assert abs(float(found) - THEORIES["ring"](gear, 210e3) * 0.1 * 0.3) < 1e-13
""",
    "the force of an array from before": """
import jax.numpy as jnp
deformation = jnp.linspace(0.1, 0.5, 5)
assert deformation.dtype == jnp.float32
"""
    + GEAR
    + "found = hdcal.force(gear, 210e3, 0.1, deformation)",
    "a theory": GEAR
    + "from hdcal.physics.theory import THEORIES\n"
    + "found = THEORIES['cup'](gear, 210e3)",
    "a profile": GEAR
    + "from hdcal.physics.profile import ring_profile\n"
    + "found = ring_profile(gear, 210e3, 0.3, [0.0, 1.0]).stress",
    "a gear in what is differentiated": GEAR
    + """
import jax
from dataclasses import replace
wall = jax.grad(lambda d: hdcal.force(replace(gear, wall_thickness=d), 2e5, 0.1, 0.3))
found = wall(0.68)
""",
    "a gear that another process has sent": """
import base64, os, pickle, jax
gear = pickle.loads(base64.b64decode(os.environ["SENT"]))
assert jax.config.jax_enable_x64
from hdcal.physics.theory import THEORIES
found = THEORIES["cup"](gear, 210e3)
assert found.dtype == "float64"
""",
    "a case": """
import hdcal, jax.numpy as jnp
case = hdcal.read_case("datasets/thermal-demo")
found = jnp.asarray(case.records.force)
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


def test_importing_hdcal_loads_no_jax():
    run(UNLOADED)


def test_no_import_and_no_name_changes_state_or_makes_an_array():
    run(STATE + TOUCH, **NO_ARRAYS)


@pytest.mark.thorough
def test_a_change_or_an_array_would_be_seen():
    run(STATE + PLANTED, **NO_ARRAYS)


@pytest.mark.parametrize("first", slice_of(FIRST_ARRAYS, ["a case", "a theory"]))
def test_first_arrays_are_in_double_precision(first: str):
    gear = hdcal.Geometry(0.68, 40.0, 70.0, 70.0, 0.3)
    told = "\nassert found.dtype == 'float64', found.dtype"
    sent = base64.b64encode(pickle.dumps(gear)).decode()
    run(FIRST_ARRAYS[first] + told, SENT=sent)


def test_a_first_gear_within_what_is_compiled_is_refused():
    run(WITHIN)
