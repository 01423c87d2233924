"""The public names of hdcal load on first use."""

import subprocess
import sys

import pytest

import hdcal

LOADED = """
import sys
from pathlib import Path
before = set(sys.modules)
import hdcal
print(*sorted({name.partition(".")[0] for name in set(sys.modules) - before}))
"""


@pytest.mark.parametrize("name", hdcal.__all__)
def test_every_name_can_be_imported_by_itself(name):
    space = {}
    exec(f"from hdcal import {name}", space)
    assert space[name] is getattr(hdcal, name)


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="'calibrte'"):
        _ = hdcal.calibrte


def test_importing_hdcal_loads_nothing_foreign():
    done = subprocess.run(
        [sys.executable, "-c", LOADED], capture_output=True, text=True, check=True
    )
    loaded = set(done.stdout.split())
    assert loaded - sys.stdlib_module_names == {"hdcal"}


def test_the_force_can_be_differentiated_batched_and_compiled():
    import jax
    import jax.numpy as jnp

    gear = hdcal.Geometry(0.68, 40.0, 70.0, 70.0, 0.3)

    def curve(gear, deformation):
        return hdcal.force(gear, 210e3, 1.0, deformation, theory="ring")

    assert float(curve(gear, 1.0)) == pytest.approx(80.905, abs=5e-4)
    deformation = jnp.linspace(0.1, 0.5, 5)
    slope = jax.jit(jax.vmap(jax.grad(curve), in_axes=(None, 0)))(gear, deformation)
    force = curve(gear, deformation)
    # F is proportional to δ³ L / R³.
    assert slope.wall_thickness == pytest.approx(3.0 * force / 0.68)
    assert slope.radius == pytest.approx(-3.0 * force / 40.0)
    assert slope.length == pytest.approx(force / 70.0)
    assert slope.poisson == pytest.approx(0.0, abs=1e-12)
