"""Work shared by processes of this machine."""

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
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
    """Return what `work` makes of every task, in their order.

    Args:
        work: can be imported by name where there are several jobs.
        tasks: its arguments.
        jobs: processes; one is this process, so that compiled code is used again.
        progress: is told how many tasks of how many are done.
    """
    results: list[Any] = [None] * len(tasks)
    for done, (index, result) in enumerate(completed(work, tasks, jobs), start=1):
        results[index] = result
        if progress is not None:
            progress(done, len(tasks))
    return results


def completed(
    work: Callable, tasks: Sequence[tuple], jobs: int
) -> Iterator[tuple[int, Any]]:
    """Yield the number of a task and what `work` makes of it, as each is done.

    Args:
        work: can be imported by name where there are several jobs.
        tasks: its arguments.
        jobs: processes; one is this process, so that compiled code is used again.
    """
    if min(jobs, len(tasks)) == 1:
        for index, task in enumerate(tasks):
            yield index, work(*task)
        return
    others = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(
        min(jobs, len(tasks)),
        # A fork of a process in which JAX has begun hangs.
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_begin,
    )
    try:
        waiting = {pool.submit(work, *task): i for i, task in enumerate(tasks)}
        for future in as_completed(waiting):
            yield waiting.pop(future), future.result()
        pool.shutdown()
    except BaseException:
        # Nobody waits for what others have begun.
        pool.shutdown(wait=False, cancel_futures=True)
        for worker in set(multiprocessing.active_children()) - others:
            worker.terminate()
        raise


def _begin() -> None:
    """Prepare a process that works for another, which alone hears the keyboard."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Console(json=False).prepare()
    sys.stdout = open(os.devnull, "w")  # noqa: SIM115, lives as long as the process


def _end_with_parent() -> None:
    """End this process once the one that it works for is gone, however it went."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(1)
