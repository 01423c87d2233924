"""One length of run for all tests: each kind of problem is then compiled only once.

The sampler is compiled for a warm-up and for stretches of fifty iterations.
"""

# Enough to pass the checks on fourteen rows, and not more.
SHORT = {"warmup": 300, "draws": 500}
# Far too few draws for their checks; in stretches that are compiled for `SHORT`.
TOO_SHORT = {"warmup": 300, "draws": 50}


def options(settings: dict[str, int]) -> list[str]:
    """Return settings as a command takes them."""
    return [
        part for name, value in settings.items() for part in (f"--{name}", f"{value}")
    ]
