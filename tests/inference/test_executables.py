"""The sampler's executables go before mappings run out; nobody else's do."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import monitoring
from rigs import make_case, ramp

from hdcal.data.priors import effect_priors
from hdcal.inference import executables, laplace
from hdcal.inference.problem import build_problem

COMPILED = "/jax/core/compile/backend_compile_duration"


def mappings() -> int:
    return Path("/proc/self/maps").read_bytes().count(b"\n")


@pytest.fixture
def compilations():
    """Names of what JAX compiled since."""
    found = []

    def note(event: str, seconds: float, **about) -> None:
        if event == COMPILED:
            found.append(about.get("fun_name"))

    monitoring.register_event_duration_secs_listener(note)
    yield found
    monitoring.unregister_event_duration_listener(note)


@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="Linux only")
def test_they_go_when_half_the_limit_is_in_use(monkeypatch, tmp_path, compilations):
    theirs = jax.jit(lambda x: jnp.linalg.solve(x + 1.0, x))
    problem = build_problem(make_case(ramp()), effect_priors())
    fitted = laplace.fit(problem, jax.random.key(0))
    theirs(jnp.eye(2)).block_until_ready()
    full, limit = mappings(), tmp_path / "limit"
    monkeypatch.setattr(executables, "_LIMIT", limit)
    limit.write_text(str(4 * full))
    assert not executables.bound_executables()
    assert mappings() >= full
    limit.write_text(str(full))
    assert executables.bound_executables()
    assert mappings() < full - 100
    compilations.clear()
    assert np.asarray(theirs(jnp.eye(2)))[0, 0] == pytest.approx(2.0 / 3.0)
    assert not compilations
    again = laplace.fit(problem, jax.random.key(0))
    assert compilations
    assert (again.factor == fitted.factor).all()


def test_without_linux_nothing_is_done(monkeypatch, tmp_path):
    monkeypatch.setattr(executables, "_MAPS", tmp_path / "none")
    assert not executables.bound_executables()
