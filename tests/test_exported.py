"""Traces that are kept between processes give the numbers of `jax.jit`."""

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


def power(tree, x, *, degree):
    TRACED.append("power")
    return {"value": tree["a"] * x**degree, "pair": (x, tree["b"])}


FACTOR = 1.0


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


def kept(folder: Path) -> list[Path]:
    return [*folder.glob("export-*/*")]


def compiled():
    return jit(power, static_argnames=("degree",))


def run_again(folder: Path) -> list[float]:
    done = subprocess.run(
        [sys.executable, "-c", AGAIN],
        cwd=Path(__file__).parent,
        env=os.environ
        | {"JAX_COMPILATION_CACHE_DIR": str(folder), "JAX_ENABLE_X64": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return [float(word) for word in done.stdout.split()]


def test_numbers_and_structure_are_those_of_jax_jit(folder: Path):
    expected = jax.jit(power, static_argnames=("degree",))(TREE, X, degree=3)
    found = compiled()(TREE, X, degree=3)
    assert jax.tree.structure(found) == jax.tree.structure(expected)
    for one, other in zip(*map(jax.tree.leaves, (found, expected)), strict=True):
        np.testing.assert_array_equal(one, other)
    assert len(kept(folder)) == 1


def test_each_kind_of_arguments_has_its_own_program(folder: Path):
    function = compiled()
    for degree, x in ((2, X), (3, X), (3, X[:1]), (3, X.astype(np.float32))):
        np.testing.assert_allclose(
            function(TREE, x, degree=degree)["value"], TREE["a"] * x**degree, rtol=1e-6
        )
    assert len(kept(folder)) == 4
    function(TREE, X, degree=2)
    assert len(TRACED) == 4


def test_another_process_traces_nothing_unless_the_file_is_damaged(folder: Path):
    Geometry(0.68, 40.0, 70.0, 70.0, 0.3)
    expected = [*map(float, compiled()(TREE, X, degree=2)["value"])]
    (file,) = kept(folder)
    damaged = file.read_bytes()[: file.stat().st_size // 2]
    file.write_bytes(damaged)
    assert run_again(folder) == [1.0, *expected]
    # The trace made anew need not have the length of the first: it holds less of
    # where the code was called from.
    assert kept(folder)[0].read_bytes() != damaged
    assert run_again(folder) == [0.0, *expected]


def test_changed_code_is_traced_anew(folder: Path, monkeypatch: pytest.MonkeyPatch):
    compiled()(TREE, X, degree=2)
    monkeypatch.setattr(exported, "_code", lambda: "another")
    compiled()(TREE, X, degree=2)
    assert len(TRACED) == 2 and len(kept(folder)) == 2


class Foreign:
    pass


jax.tree_util.register_pytree_node(Foreign, lambda f: ((1.0,), None), lambda *_: ...)


def test_code_that_is_in_no_digest_is_not_kept(folder: Path):
    assert float(jit(lambda own: jnp.sum(jnp.ones(3)))(Foreign())) == 3.0
    assert not kept(folder)


def test_within_another_program_nothing_is_kept(monkeypatch: pytest.MonkeyPatch):
    """Code that has changed is traced anew by the next program that holds it."""
    monkeypatch.setattr(sys.modules[__name__], "FACTOR", 2.0)
    inner = jit(scaled)
    assert jax.jit(lambda x: inner(x) + 0.0)(1.0) == 2.0
    monkeypatch.setattr(sys.modules[__name__], "FACTOR", 3.0)
    assert jax.jit(lambda x: inner(x) + 1.0)(1.0) == 4.0


def test_transformations_pass_through():
    geometry = Geometry(0.68, 40.0, 70.0, 70.0, 0.3)
    force = THEORIES["ring"]
    slope = jax.grad(lambda modulus: force(geometry, modulus))(210e3)
    np.testing.assert_allclose(slope * 210e3, force(geometry, 210e3), rtol=1e-12)
    many = jax.vmap(lambda modulus: force(geometry, modulus))(jnp.array([1.0, 2.0]))
    np.testing.assert_allclose(many[1], 2.0 * many[0], rtol=1e-12)
