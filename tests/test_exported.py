"""Programs cached between processes give the numbers of `jax.jit`."""

import os
import subprocess
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hdcal import exported
from hdcal.data.records import Geometry
from hdcal.exported import jit
from hdcal.physics.theory import THEORIES

TRACED: list[str] = []
FACTOR = 1.0


def power(tree, x, *, degree):
    TRACED.append("power")
    return {"value": tree["a"] * x**degree, "pair": (x, tree["b"])}


def scaled(x):
    return FACTOR * x


TREE = {"a": np.array([1.0, 2.0]), "b": 3.0}
X = np.array([0.5, 2.0])
# Another process: how often it traces, and what comes out.
AGAIN = """
import numpy as np
from test_exported import TRACED, TREE, X, power
from hdcal.exported import jit
found = jit(power, static_argnames=("degree",))(TREE, X, degree=2)
print(len(TRACED), *map(float, found["value"]))
"""


@pytest.fixture
def folder(tmp_path: Path):
    before = jax.config.jax_compilation_cache_dir
    jax.config.update("jax_compilation_cache_dir", str(tmp_path))
    TRACED.clear()
    yield tmp_path
    jax.config.update("jax_compilation_cache_dir", before)


def cached(folder: Path) -> list[Path]:
    return [*folder.glob("export-*/*")]


def compiled():
    return jit(power, static_argnames=("degree",))


def run_again(folder: Path) -> list[float]:
    variables = {"JAX_COMPILATION_CACHE_DIR": str(folder), "JAX_ENABLE_X64": "1"}
    done = subprocess.run(
        [sys.executable, "-c", AGAIN],
        cwd=Path(__file__).parent,
        env=os.environ | variables,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return [float(word) for word in done.stdout.split()]


def test_each_kind_of_arguments_has_the_program_of_jax_jit(folder: Path):
    function, expected = compiled(), jax.jit(power, static_argnames=("degree",))
    kinds = ((2, X), (3, X), (3, X[:1]), (3, X.astype(np.float32)))
    for degree, x in kinds:
        found, other = (f(TREE, x, degree=degree) for f in (function, expected))
        assert jax.tree.structure(found) == jax.tree.structure(other)
        for one, two in zip(*map(jax.tree.leaves, (found, other)), strict=True):
            np.testing.assert_array_equal(one, two)
    assert len(cached(folder)) == 4
    before = len(TRACED)
    function(TREE, X, degree=2)
    assert len(TRACED) == before


def test_another_process_traces_nothing_unless_the_file_is_damaged(folder: Path):
    Geometry(0.68, 40.0, 70.0, 70.0, 0.3)
    expected = [*map(float, compiled()(TREE, X, degree=2)["value"])]
    assert run_again(folder) == [0.0, *expected]
    (file,) = cached(folder)
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    assert [*map(float, compiled()(TREE, X, degree=2)["value"])] == expected
    assert len(TRACED) == 2


def test_changed_code_is_traced_anew(folder: Path, monkeypatch: pytest.MonkeyPatch):
    # The fixture of all tests turns the cache off where code is replaced.
    monkeypatch.setattr(exported, "_needs_plain_jit", lambda: False)
    compiled()(TREE, X, degree=2)
    monkeypatch.setattr(exported, "_code", lambda: "another")
    compiled()(TREE, X, degree=2)
    assert len(TRACED) == 2 and len(cached(folder)) == 2


class Foreign:
    pass


jax.tree_util.register_pytree_node(Foreign, lambda f: ((1.0,), None), lambda *_: ...)


def test_code_outside_the_digest_is_not_cached(folder: Path):
    assert float(jit(lambda own: jnp.sum(jnp.ones(3)))(Foreign())) == 3.0
    assert not cached(folder)


def test_within_another_program_nothing_is_cached(monkeypatch: pytest.MonkeyPatch):
    inner = jit(scaled)
    for factor in (2.0, 3.0):
        monkeypatch.setattr(sys.modules[__name__], "FACTOR", factor)
        assert jax.jit(lambda x, f=factor: inner(x) + f)(1.0) == 2.0 * factor


def test_transformations_pass_through():
    geometry = Geometry(0.68, 40.0, 70.0, 70.0, 0.3)
    force = THEORIES["ring"]
    slope = jax.grad(lambda modulus: force(geometry, modulus))(210e3)
    np.testing.assert_allclose(slope * 210e3, force(geometry, 210e3), rtol=1e-12)
    many = jax.vmap(lambda modulus: force(geometry, modulus))(jnp.array([1.0, 2.0]))
    np.testing.assert_allclose(many[1], 2.0 * many[0], rtol=1e-12)
