"""Versions of the packages that a result depends on."""

from importlib import metadata

_PACKAGES = ("hdcal", "jax", "numpyro", "arviz-base", "scipy", "numpy")


def versions() -> dict[str, str]:
    """Return the versions by package."""
    return {package: metadata.version(package) for package in _PACKAGES}
