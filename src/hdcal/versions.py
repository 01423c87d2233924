"""Which versions of which packages a result depends on."""

from functools import cache
from importlib import metadata

_PACKAGES = ("hdcal", "jax", "numpyro", "arviz-base", "scipy", "numpy")


def versions() -> dict[str, str]:
    """Return the versions of the packages that a result depends on."""
    return {package: _version(package) for package in _PACKAGES}


@cache
def _version(package: str) -> str:
    return metadata.version(package)
