"""Folders of the shipped prior tables, data sets and pages."""

from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Any

# Pages that are made when the documentation is built.
_FOR_THE_WEB = ("api", "schemas", "ranges")
_PAGE_FOLDERS = ("howto", "reference", "validation", "reference/effects")


def priors_folder() -> Traversable:
    """Return the folder of the prior tables: the rig's, the effects' and materials'."""
    return _shipped("priors")


def datasets_folder() -> Traversable:
    """Return the folder of the example data sets, one subfolder each."""
    return _shipped("datasets")


def pages() -> dict[str, Traversable]:
    """Return the pages of the documentation by their names, how-tos first."""
    root, found = _shipped("docs"), {}
    for folder in _PAGE_FOLDERS:
        for page in sorted((root / folder).iterdir(), key=lambda page: page.name):
            name, dot, kind = page.name.rpartition(".")
            # The list of effects is called by its folder.
            name = "effects" if (folder, name) == (_PAGE_FOLDERS[-1], "index") else name
            if dot and kind == "md" and name not in ("index", *_FOR_THE_WEB):
                found[name] = page
    return found


def _shipped(name: str) -> Traversable:
    # pathlib.Path and zipfile.Path both know their parent; Traversable does not.
    data: Any = files("hdcal.data")
    package = data.parent
    for candidate in (package / "_data" / name, package.parent.parent / name):
        if candidate.is_dir():
            return candidate
    raise FileNotFoundError(f"this installation of hdcal has no '{name}' folder")
