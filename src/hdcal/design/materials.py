"""The materials of which a gear may be made."""

from pathlib import Path

from hdcal.data.gear_file.toml_file import did_you_mean
from hdcal.data.priors import Prior, material_names, material_priors, read_material
from hdcal.errors import Finding, InputError


def material_of(name: str) -> dict[str, Prior]:
    """Return the facts of a material: a shipped one, or the path of a .toml file.

    Raises:
        InputError: it is unknown, or its file is incomplete.
    """
    if name.endswith(".toml"):
        return read_material(Path(name), name)
    if name not in material_names():
        words = f"unknown material '{name}'"
        remedy = did_you_mean(name, material_names(), "Shipped are")
        raise InputError([Finding("materials", words, remedy)])
    return material_priors(name)
