"""What a command needs later is imported while XLA computes."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from importlib import import_module


@contextmanager
def imported_meanwhile(module: str) -> Iterator[None]:
    """Import a module in a thread, which has ended when the context ends.

    Where that fails, whoever needs the module imports it, and hears why it cannot be.
    """
    with ThreadPoolExecutor(1) as thread:
        thread.submit(import_module, module)
        yield
