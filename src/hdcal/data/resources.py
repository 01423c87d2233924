"""Where the shipped prior tables and data sets are."""

from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Any


def priors_folder() -> Traversable:
    """Folder of the prior tables: `rig.toml`, `effects.toml` and the materials.

    Raises:
        FileNotFoundError: the installation carries no prior tables.
    """
    return _shipped("priors")


def datasets_folder() -> Traversable:
    """Folder of the example data sets, one subfolder each.

    Raises:
        FileNotFoundError: the installation carries no data sets.
    """
    return _shipped("datasets")


def _shipped(name: str) -> Traversable:
    # pathlib.Path and zipfile.Path both know their parent; Traversable does not.
    package: Any = files("hdcal.data")
    package = package.parent
    checkout = package.parent.parent
    for candidate in (package / "_data" / name, checkout / name):
        if candidate.is_dir():
            return candidate
    raise FileNotFoundError(f"this installation of hdcal has no '{name}' folder")
