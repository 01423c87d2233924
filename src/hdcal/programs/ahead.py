"""Programs that are loaded ahead, beside what else is done before they are called.

Most of what a kept program costs is loading, which XLA does while Python goes on. What
a task called the last time is what it will call; as soon as it calls anything else,
no more is loaded.
"""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

from hdcal.programs.compiling import compile_loops_whole
from hdcal.programs.files import folder, put, read

# More at once would fill what memory mappings a process may have.
_MOST = 150
# By file: the names of those that were called, in their order, and those to come.
_called: dict[Path, str] = {}
_coming: dict[Path, Future] = {}


def begin(task: str) -> None:
    """Begin to load what a task called the last time."""
    listed = _list_of(task)
    if listed is None:
        return
    compile_loops_whole()
    pool = ThreadPoolExecutor(1)
    for file in [*_read_list(listed)][:_MOST]:
        _coming[file] = pool.submit(read, file)
    pool.shutdown(wait=False)


def end(task: str) -> None:
    """Load no more, and keep in mind what the task called."""
    release()
    # After an interruption other threads may go on to call.
    listed, needed = _list_of(task), {**_called}
    if listed is None or needed.keys() <= _read_list(listed).keys():
        return
    lines = [f"{file.name} {name}\n" for file, name in needed.items()]
    put(listed, "".join(lines).encode())


def called(file: Path, name: str) -> Callable | None:
    """Return a kept program that is loaded, or nearly; None where another has to be.

    Args:
        file: where it is kept.
        name: of its function.
    """
    _called.setdefault(file, name)
    # It stays there: two threads may call the same.
    coming = _coming.get(file)
    if coming is None:
        for one in [*_coming.values()]:
            one.cancel()
    elif not coming.cancel():
        # It is not to be had there for the reason for which it is not to be had here.
        with suppress(Exception):
            return coming.result()
    return None


def release() -> None:
    """Load no more, and hold nothing that was loaded."""
    while _coming:
        with suppress(KeyError):
            _coming.popitem()[1].cancel()


def _list_of(task: str) -> Path | None:
    kept = folder()
    return None if kept is None else kept / f"{task}.called"


def _read_list(listed: Path) -> dict[Path, str]:
    """Return the programs of a list; of one that is damaged those that it names."""
    try:
        lines = listed.read_text("utf-8").splitlines()
    except (OSError, ValueError):
        return {}
    pairs = [line.split() for line in lines]
    return {listed.with_name(one[0]): one[1] for one in pairs if len(one) == 2}
