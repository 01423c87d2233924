"""Tasks on a Dask cluster."""

import logging
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from itertools import islice
from typing import Any

from hdcal.errors import Finding, HdcalError, InputError

_SECONDS_TO_ANSWER, _SECONDS_FOR_A_WORKER = 10, 30
# Tasks per thread that are sent in advance.
_AHEAD = 2


def completed_on_cluster(
    work: Callable, tasks: Iterator[tuple], address: str, lost: str
) -> Iterator[Any]:
    """Yield the result of `work` for every task, in the order of completion.

    `work` can be imported by name on the workers; `tasks`, its arguments, are taken as
    workers become free; `lost` is the remedy if the cluster is lost (`HdcalError`).
    """
    with _client(address) as client:
        from distributed import KilledWorker, as_completed

        width = _AHEAD * max(1, sum(client.nthreads().values()))
        # Impure: equal tasks are run separately.
        begun = (client.submit(work, *task, pure=False) for task in tasks)
        waiting = as_completed(list(islice(begun, width)), loop=client.loop)
        try:
            for future in waiting:
                outcome = future.result()
                future.release()
                waiting.update(list(islice(begun, 1)))
                yield outcome
        except (KilledWorker, CancelledError, OSError) as error:
            words = "the connection to the scheduler was lost"
            if isinstance(error, KilledWorker):
                words = "one task stopped several workers, possibly for lack of memory"
            raise HdcalError(f"--scheduler {address}: {words}; {lost}") from error


@contextmanager
def _client(address: str) -> Iterator[Any]:
    try:
        from distributed import Client
    except ImportError:
        words = "Dask's package 'distributed' is not installed"
        raise _refusal(words, "Install hdcal[cluster], or leave it out") from None
    # A lost connection is reported once, as an error. Dask's loggers have levels and
    # handlers of their own.
    for name in list(logging.root.manager.loggerDict):
        if name.startswith("distributed"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        client = Client(address, timeout=_SECONDS_TO_ANSWER, set_as_default=False)
    except (OSError, ValueError) as error:
        reason = " ".join(str(error).split())[:120]
        words = f"no scheduler answers at '{address[:80]}' ({reason})"
        remedy = "Start one with 'dask scheduler' and give its address"
        raise _refusal(words, remedy) from None
    try:
        client.wait_for_workers(1, timeout=_SECONDS_FOR_A_WORKER)
        yield client
    except TimeoutError:
        words = f"the scheduler at '{address[:80]}' has no workers"
        remedy = f"Start some with 'dask worker {address[:80]}'"
        raise _refusal(words, remedy) from None
    finally:
        client.close(timeout=_SECONDS_TO_ANSWER)


def _refusal(problem: str, remedy: str) -> InputError:
    return InputError([Finding("scheduler", problem, remedy)])
