"""The materials of which a gear may be made."""

from pathlib import Path

from hdcal.data.gear_file.toml_file import did_you_mean
from hdcal.data.priors import (
    MATERIAL_UNITS,
    Prior,
    material_names,
    material_priors,
    read_priors,
)
from hdcal.errors import Finding, InputError

_FACTS = ("E0", "alpha", "poisson")


def read_material(name: str) -> dict[str, Prior]:
    """Return the facts of a material.

    Args:
        name: a shipped one, or the path of a .toml file.

    Raises:
        InputError: it is unknown, or its file is incomplete.
    """
    if not name.endswith(".toml"):
        if name not in material_names():
            words = f"unknown material '{name}'"
            remedy = did_you_mean(name, material_names(), "Shipped are")
            raise InputError([Finding("materials", words, remedy)])
        return material_priors(name)
    facts = read_priors(Path(name), MATERIAL_UNITS, name)
    lacking = [need for need in _FACTS if need not in facts]
    if lacking:
        words = f"the material has no {' and no '.join(lacking)}"
        raise InputError([Finding(name, words, "Write a table for each")])
    return facts
