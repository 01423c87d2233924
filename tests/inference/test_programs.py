"""Compiled programs are let go before the system's limit on mappings is met."""

from pathlib import Path

import jax
import jax.numpy as jnp
import pytest

from hdcal.inference import programs


def mappings() -> int:
    return Path("/proc/self/maps").read_bytes().count(b"\n")


@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="Linux only")
def test_they_go_when_half_the_limit_is_in_use(monkeypatch, tmp_path):
    kept = [jax.jit(lambda x, i=i: jnp.linalg.solve(x + i, x)) for i in range(20)]
    for function in kept:
        function(jnp.eye(4)).block_until_ready()
    full, limit = mappings(), tmp_path / "limit"
    monkeypatch.setattr(programs, "_LIMIT", limit)
    limit.write_text(str(4 * full))
    assert not programs.let_go_of_programs()
    assert mappings() >= full
    limit.write_text(str(full))
    assert programs.let_go_of_programs()
    assert mappings() < full - 100
    assert kept[1](jnp.eye(2))[0, 0] == pytest.approx(2.0 / 3.0)


def test_without_linux_nothing_is_done(monkeypatch, tmp_path):
    monkeypatch.setattr(programs, "_MAPS", tmp_path / "none")
    assert not programs.let_go_of_programs()
