"""Sizes of one bucket share executables; the sampler's go before mappings run out."""

from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from compiling import compilations
from moving import moving_case
from rigs import make_case, ramp

from hdcal import calibrate, calibrate_dynamic, residuals
from hdcal.data.priors import effect_priors
from hdcal.inference import executables, laplace
from hdcal.inference.padding import bucket_size
from hdcal.inference.problem import build_problem
from hdcal.motion.bands import motion_bands

# What is compiled does not depend on how long it runs.
BRIEFLY = {"warmup": 50, "draws": 50}


def mappings() -> int:
    return Path("/proc/self/maps").read_bytes().count(b"\n")


@pytest.fixture(name="compilations")
def noted():
    """Names of what JAX compiles meanwhile."""
    with compilations() as found:
        yield found


def bent(rows: int):
    """Return a ramp that grows faster than its deformation."""
    records = ramp(rows)
    noise = np.random.default_rng(rows).normal(0.0, 0.6, rows)
    force = 205.0 * records.deformation + 40.0 * records.deformation**3 + noise
    return make_case(replace(records, force=force))


def calibrate_bent(case):
    settings = {"effects": ["progressive_stiffening"], "with_gap": True, **BRIEFLY}
    return residuals(calibrate(case, **settings))


def calibrate_with_gap(case):
    return residuals(calibrate(case, with_gap=True, **BRIEFLY))


def calibrate_moving(case):
    return motion_bands(calibrate_dynamic(case, effects=(), **BRIEFLY))


# Two numbers of rows of one bucket.
KINDS = {
    "at rest": (bent, calibrate_bent, (49, 60)),
    "with a gap": (bent, calibrate_with_gap, (49, 60)),
    "moving": (lambda rows: moving_case(0, rows=rows), calibrate_moving, (200, 250)),
}


@pytest.mark.thorough
@pytest.mark.parametrize("kind", KINDS)
def test_sizes_of_one_bucket_share_every_executable(
    kind: str, compilations, monkeypatch
):
    # Whatever other tests have compiled, and however near the limit they came.
    monkeypatch.setattr(executables, "mappings_are_scarce", lambda: True)
    assert executables.bound_executables()
    monkeypatch.setattr(executables, "mappings_are_scarce", lambda: False)
    make, run, sizes = KINDS[kind]
    assert len({bucket_size(rows) for rows in sizes}) == 1
    first, same = map(make, sizes)
    compilations.clear()
    run(first)
    assert "jit(_advance)" in compilations
    compilations.clear()
    run(same)
    assert compilations == []


@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="Linux only")
def test_they_go_when_half_the_limit_is_in_use(monkeypatch, tmp_path, compilations):
    theirs = jax.jit(lambda x: jnp.linalg.solve(x + 1.0, x))
    problem = build_problem(make_case(ramp()), effect_priors())
    theirs(jnp.eye(2)).block_until_ready()
    # What is none of the sampler's stays, and is here already.
    laplace.fit(problem)
    limit = tmp_path / "limit"
    monkeypatch.setattr(executables, "_LIMIT", limit)
    # Of what other tests left there.
    limit.write_text("1")
    assert executables.bound_executables()
    empty = mappings()
    fitted = laplace.fit(problem)
    full = mappings()
    assert full > empty
    limit.write_text(str(4 * full))
    assert not executables.bound_executables()
    assert mappings() >= full
    limit.write_text(str(full))
    assert executables.bound_executables()
    assert mappings() < (full + empty) / 2
    compilations.clear()
    assert np.asarray(theirs(jnp.eye(2)))[0, 0] == pytest.approx(2.0 / 3.0)
    assert not compilations
    again = laplace.fit(problem)
    assert compilations
    assert (again.factor == fitted.factor).all()


def test_without_linux_nothing_is_done(monkeypatch, tmp_path):
    monkeypatch.setattr(executables, "_MAPS", tmp_path / "none")
    assert not executables.bound_executables()
