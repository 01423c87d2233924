"""Tasks in several processes of this machine."""

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing.connection import wait
from typing import Any

from hdcal.cli.console import Console


def run_all(
    work: Callable,
    tasks: Sequence[tuple],
    jobs: int,
    progress: Callable[[int, int], None] | None = None,
) -> list[Any]:
    """Return the result of `work` for every task, its arguments, in their order.

    Of several jobs each is a process, which imports `work` by name; a single one is
    this process, which keeps compiled code. `progress` takes the numbers of done and of
    all tasks.
    """
    report = progress or (lambda done, total: None)
    jobs = min(jobs, len(tasks))
    if jobs == 1:
        results = []
        for task in tasks:
            results.append(work(*task))
            report(len(results), len(tasks))
        return results
    others = {*multiprocessing.active_children()}
    # A fork of a process in which JAX has started hangs.
    spawn = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(jobs, mp_context=spawn, initializer=_begin)
    try:
        futures = [pool.submit(work, *task) for task in tasks]
        for done, future in enumerate(as_completed(futures), start=1):
            future.result()
            report(done, len(tasks))
        pool.shutdown()
        return [future.result() for future in futures]
    except BaseException:
        # Do not wait for running tasks.
        pool.shutdown(wait=False, cancel_futures=True)
        for worker in {*multiprocessing.active_children()} - others:
            worker.terminate()
        raise


def _begin() -> None:
    """Prepare a worker process; only its parent handles interrupts."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Console(json=False).prepare()
    sys.stdout = open(os.devnull, "w")  # noqa: SIM115, lives as long as the process


def _end_with_parent() -> None:
    """Exit when the parent, killed, cannot stop this process."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(1)
