"""What JAX compiles meanwhile."""

from collections.abc import Iterator
from contextlib import contextmanager

from jax import monitoring

_COMPILED = "/jax/core/compile/backend_compile_duration"


@contextmanager
def compilations() -> Iterator[list[str]]:
    """Give a list to which every executable that is compiled inside adds its name."""
    found: list[str] = []

    def note(event: str, seconds: float, **about) -> None:
        if event == _COMPILED:
            found.append(str(about.get("fun_name")))

    monitoring.register_event_duration_secs_listener(note)
    try:
        yield found
    finally:
        monitoring.unregister_event_duration_listener(note)
