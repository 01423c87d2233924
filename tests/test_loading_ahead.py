"""What a task called the last time is loaded while other things are done."""

import threading
from collections.abc import Iterator
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from commands import Hdcal
from jax._src import compiler
from moving import still_posterior
from posteriors import single

from hdcal.programs import ahead, files
from hdcal.programs import program as made
from hdcal.programs.program import Program

X = np.linspace(0.0, 1.0, 5)


def first(x):
    """Return one thing."""
    return jnp.cumsum(x)


def second(x):
    """Return another."""
    return jnp.sin(x)


def third(x):
    """Return what no task expects."""
    return jnp.cos(x)


@pytest.fixture
def cached(monkeypatch, tmp_path) -> Iterator[Path]:
    """Give a cache, and a process that has called nothing."""
    monkeypatch.undo()
    before = files._kept_in
    files.keep_in(str(tmp_path))
    monkeypatch.setattr(ahead, "_called", {})
    monkeypatch.setattr(ahead, "_coming", {})
    with jax.enable_x64(True):
        yield tmp_path
    files.keep_in(before)


@pytest.fixture
def task(cached) -> list[np.ndarray]:
    """Return what a task found that called two programs."""
    found = [np.asarray(Program(one)(X)) for one in (first, second)]
    ahead.end("task")
    ahead._called.clear()
    return found


def loaded() -> None:
    """Wait until all is loaded that is coming."""
    for one in ahead._coming.values():
        assert one.result() is not None


def test_a_program_that_came_is_neither_read_nor_compiled_when_it_is_called(
    task, monkeypatch
):
    ahead.begin("task")
    loaded()
    monkeypatch.setattr(made, "read", None)
    for one, was in zip((first, second), task, strict=True):
        with monkeypatch.context() as patch:
            patch.setattr(compiler, "compile_or_get_cached", None)
            np.testing.assert_array_equal(Program(one)(X), was)


def test_what_was_compiled_for_what_another_returned_serves(cached):
    """Bound to its device it would be compiled as another program."""
    bound = jax.device_put(Program(first)(X), jax.devices()[0])
    found = Program(second)(bound)
    assert bound.committed
    ahead.end("task")
    kept = {*cached.rglob("*")}
    ahead._called.clear()
    ahead.begin("task")
    loaded()
    np.testing.assert_array_equal(Program(second)(np.cumsum(X)), found)
    assert {*cached.rglob("*")} == kept and len(kept) >= 4


def test_without_having_come_it_is_read(task, monkeypatch):
    """What the test above would see."""
    monkeypatch.setattr(made, "read", None)
    with pytest.raises(TypeError):
        Program(first)(X)


def test_what_has_not_begun_is_done_by_who_calls_it(task, monkeypatch):
    free, real = threading.Event(), files.read

    def waiting(file):
        free.wait(60)
        return real(file)

    monkeypatch.setattr(ahead, "read", waiting)
    ahead.begin("task")
    # The first one is being loaded, and the second waits for it.
    np.testing.assert_array_equal(Program(second)(X), task[1])
    free.set()
    np.testing.assert_array_equal(Program(first)(X), task[0])


def test_another_call_than_expected_ends_it(task, monkeypatch):
    free = threading.Event()
    monkeypatch.setattr(ahead, "read", lambda _: free.wait(60) and None)
    ahead.begin("task")
    waits = [*ahead._coming.values()][1]
    np.testing.assert_allclose(Program(third)(X), np.cos(X))
    assert waits.cancelled()
    free.set()
    # What came to nothing is made as ever.
    np.testing.assert_array_equal(Program(first)(X), task[0])
    ahead.end("task")
    (listed,) = files.folder().glob("*.called")
    names = [line.split()[1] for line in listed.read_text().splitlines()]
    assert names == ["third", "first"]


def test_two_threads_may_call_the_same(task):
    ahead.begin("task")
    waits = [*ahead._coming.values()]
    for _ in range(2):
        np.testing.assert_array_equal(Program(first)(X), task[0])
    assert not any(one.cancelled() for one in waits[1:])
    np.testing.assert_array_equal(Program(second)(X), task[1])


def test_a_list_without_end_is_not_loaded_whole(task, cached):
    (listed,) = cached.rglob("*.called")
    listed.write_text("".join(f"{place} first\n" for place in range(1000)))
    ahead.begin("task")
    assert len(ahead._coming) == ahead._MOST
    ahead.release()
    assert not ahead._coming


def test_a_shorter_run_forgets_nothing(task, cached):
    (listed,) = cached.rglob("*.called")
    before = listed.read_bytes()
    ahead.begin("task")
    Program(first)(X)
    ahead.end("task")
    assert listed.read_bytes() == before


@pytest.mark.parametrize("spoil", [b"", b"\xff\xfe", b"x\nno such\n", None])
def test_a_list_that_is_damaged_is_no_error(task, cached, spoil):
    (listed,) = cached.rglob("*.called")
    if spoil is None:
        for file in listed.parent.iterdir():
            if file != listed:
                file.write_bytes(b"damaged")
    else:
        listed.write_bytes(spoil)
    ahead.begin("task")
    for one, was in zip((first, second), task, strict=True):
        np.testing.assert_array_equal(Program(one)(X), was)
    ahead.end("task")
    assert listed.read_text().splitlines()[-1].endswith("second")


def test_nothing_is_loaded_where_nothing_is_kept(cached):
    files.keep_in(None)
    ahead.begin("task")
    np.testing.assert_allclose(Program(first)(X), np.cumsum(X))
    ahead.end("task")
    assert not ahead._coming and not [*cached.iterdir()]


def test_commands_say_the_same_with_and_without(hdcal: Hdcal, tmp_path, monkeypatch):
    monkeypatch.setenv("HDCAL_CACHE_DIR", str(tmp_path / "cache"))
    single().save(tmp_path / "posterior.nc")
    asked = "predict", str(tmp_path / "posterior.nc"), "--deformation", "0.2,0.4"
    told = [hdcal(*asked).stdout for _ in range(3)]
    (listed,) = (tmp_path / "cache").rglob("*.called")
    assert listed.name == "hdcal-predict-deformation-run.called"
    assert "readings" in listed.read_text()
    assert told[0] == told[1] == told[2] and "0.4,20" in told[0]


def test_a_program_that_integrates_over_time_is_kept(
    hdcal: Hdcal, tmp_path, monkeypatch
):
    """Though its library may raise an error from within."""
    monkeypatch.setenv("HDCAL_CACHE_DIR", str(tmp_path / "cache"))
    still_posterior().save(tmp_path / "posterior.nc")
    asked = "--force", "step", "--amplitude", "40", "--duration", "0.02"
    where = "--out", str(tmp_path / "response")
    done = hdcal("respond", str(tmp_path / "posterior.nc"), *asked, *where)
    assert done.returncode == 0, done.stderr
    (listed,) = (tmp_path / "cache").rglob("*.called")
    called = dict(line.split()[::-1] for line in listed.read_text().splitlines())
    assert listed.with_name(called["_each"]).exists()
