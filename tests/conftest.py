"""Compiled programs: shared by all processes of a test run, and dropped in time."""

import gc
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

import pytest

pytest_plugins = ["commands", "clusters"]

_OWN = pytest.StashKey[str]()
_COMPILED_PLAINLY = (
    "--xla_backend_optimization_level=1 --xla_cpu_parallel_codegen_split_count=1 "
    "--xla_backend_extra_options=xla_cpu_small_while_loop_byte_threshold=100000000"
)
# XLA ends a process that names a flag which it does not know, as later ones this one.
if version("jaxlib").startswith("0.10."):
    _COMPILED_PLAINLY += " --xla_cpu_use_fusion_emitters=false"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let a run take some of the files: --part 3/8, every eighth of them."""
    words = "I/N: part I of N of the files with tests"
    parser.addoption("--part", help=words)


@pytest.hookimpl(trylast=True)  # of the tests that -m has chosen
def pytest_collection_modifyitems(
    config: pytest.Config, items: list[pytest.Item]
) -> None:
    """Keep the files of the part that was asked for."""
    if part := config.getoption("--part"):
        one, of = map(int, part.split("/"))
        kept = {*sorted({item.path for item in items})[one % of :: of]}
        config.hook.pytest_deselected(items=[i for i in items if i.path not in kept])
        items[:] = [item for item in items if item.path in kept]


def pytest_configure(config: pytest.Config) -> None:
    """Name one cache for this process, its workers and every command they start."""
    # To trace a model makes many objects and little garbage.
    gc.set_threshold(100_000, 10, 10)
    if "PYTEST_XDIST_WORKER" in os.environ:
        return
    # As commands do: two processes on two cores, each with two threads, only wait.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    config.stash[_OWN] = tempfile.mkdtemp("-hdcal")
    os.environ["JAX_COMPILATION_CACHE_DIR"] = config.stash[_OWN]
    os.environ["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] = "0"
    os.environ["JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES"] = "-1"
    # Most of a test run is compilation of programs that run for less than a second:
    # compiled plainly they take less time. `make demo` runs as users do.
    os.environ.setdefault("XLA_FLAGS", _COMPILED_PLAINLY)
    os.environ.setdefault("JAX_DISABLE_MOST_OPTIMIZATIONS", "true")


def pytest_unconfigure(config: pytest.Config) -> None:
    """Remove the cache."""
    if _OWN in config.stash:
        shutil.rmtree(config.stash[_OWN], ignore_errors=True)


@pytest.fixture(scope="module", autouse=True)
def few_executables() -> Iterator[None]:
    """Forget what was compiled between files where memory mappings are scarce.

    A test run compiles for more kinds of problems than one process can hold.
    """
    yield
    if "numpyro" in sys.modules:
        import jax

        # A process may have 65,530 mappings; a compilation that finds none kills it.
        if Path("/proc/self/maps").read_bytes().count(b"\n") > 30_000:
            jax.clear_caches()
            gc.collect()
