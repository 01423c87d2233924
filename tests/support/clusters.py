"""A Dask cluster on this machine, whose workers a test may kill."""

import gc
import warnings
from collections.abc import Iterator

import pytest


def local_cluster(**settings):
    """Start a cluster; Dask gives its own thread ten seconds, which a busy machine
    does not always grant."""
    distributed = pytest.importorskip("distributed")
    for _ in range(2):
        try:
            return distributed.LocalCluster(**settings)
        except AssertionError:
            pass
        # What was half made warns when it is collected, in whatever test that is.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            gc.collect()
    return distributed.LocalCluster(**settings)


@pytest.fixture(scope="module")
def local(tmp_path_factory: pytest.TempPathFactory) -> Iterator:
    """A scheduler here, and two workers in processes and a folder of their own.

    One for all tests: who kills a worker gets a new one by its nanny.
    """
    dask = pytest.importorskip("dask")
    # Before its settings are changed: where they are put back, those that it brought
    # in meanwhile would go too, and another module's cluster would miss them.
    pytest.importorskip("distributed")
    quiet = {"distributed.scheduler.allowed-failures": 1}
    with (
        dask.config.set(quiet),
        local_cluster(
            n_workers=2,
            threads_per_worker=1,
            processes=True,
            # Without one it would take a port that others may have taken.
            dashboard_address=":0",
            silence_logs=50,
            local_directory=str(tmp_path_factory.mktemp("workers")),
        ) as found,
    ):
        yield found
