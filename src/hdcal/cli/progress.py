"""A progress bar where a person is looking, a line now and then in a log."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

# What takes no longer than this needs no sign of life in a log [s].
_LONG = 30.0


class _Quarters:
    """Says in a line how far a long task has come, at every quarter of it."""

    def __init__(self, doing: str):
        self._doing, self._told = doing, 0
        self._began = time.monotonic()

    def __call__(self, done: int, total: int) -> None:
        quarter = 4 * done // max(total, 1)
        late = time.monotonic() - self._began > _LONG
        if late and 0 < quarter < 4 and quarter != self._told:
            words = f"hdcal: {self._doing}, {25 * quarter} % done"
            print(words, file=sys.stderr, flush=True)
        self._told = quarter


@contextmanager
def progress_bar(
    doing: str = "sampling",
) -> Iterator[Callable[[int, int], None]]:
    """Yield what takes how much is done of how much."""
    if not sys.stderr.isatty():
        yield _Quarters(doing)
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        SpinnerColumn,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("preparing", total=None, start=True)

        def tell(done: int, total: int) -> None:
            bar.update(task, description=doing, completed=done, total=total)

        yield tell
