"""The public face of hdcal: these names, light to import, each documented."""

import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import hdcal

PUBLIC = [
    "Case",
    "DynamicPosterior",
    "EFFECTS",
    "Effect",
    "FleetPosterior",
    "Gear",
    "Geometry",
    "HdcalError",
    "InputError",
    "ModelAverage",
    "Noise",
    "NotUsable",
    "Posterior",
    "Prior",
    "Records",
    "Rows",
    "Tracker",
    "Verdict",
    "calibrate",
    "calibrate_dynamic",
    "causes",
    "compare",
    "diagnose",
    "fit",
    "fleet",
    "force",
    "inverse_design",
    "keep_compilations",
    "margin",
    "parameter",
    "predict",
    "read_case",
    "residuals",
    "respond",
    "study",
    "summarise",
    "wave_generator",
]
LOADED = """
import sys
from pathlib import Path
before = set(sys.modules)
import hdcal
print(*sorted({name.partition(".")[0] for name in set(sys.modules) - before}))
"""


def test_the_public_names_are_frozen():
    assert sorted(hdcal.__all__) == PUBLIC
    assert dir(hdcal) == PUBLIC


@pytest.mark.parametrize("name", PUBLIC)
def test_every_name_is_documented(name):
    public = getattr(hdcal, name)
    items = public.values() if isinstance(public, dict) else [public]
    assert items
    for item in items:
        # A dataclass without a docstring documents itself as its own signature.
        text = item.__dict__.get("__doc__") if inspect.isclass(item) else item.__doc__
        assert text
        assert not text.startswith(f"{item.__name__}(")
        first = text.splitlines()[0]
        assert len(first) <= 80
        assert first.endswith(".")


@pytest.mark.parametrize("name", PUBLIC)
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


def test_the_page_of_the_library_tells_every_public_name():
    told = (Path(__file__).parents[1] / "docs" / "api.md").read_text()
    missing = [name for name in hdcal.__all__ if f"hdcal.{name}" not in told]
    assert missing == []
