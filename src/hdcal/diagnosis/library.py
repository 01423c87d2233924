"""Which effects a diagnosis considers: the library, or a part of it."""

from collections.abc import Mapping

from hdcal.calibration.calibrate import check_names
from hdcal.errors import Finding, InputError
from hdcal.physics.effect import Effect
from hdcal.physics.registry import EFFECTS

_MINUS = "minus:"


def choose_library(
    spec: str | None = None, registry: Mapping[str, type[Effect]] = EFFECTS
) -> dict[str, type[Effect]]:
    """Return the library with some effects withheld.

    Args:
        spec: `minus:NAME[,NAME…]`, or None for the whole library.
        registry: the library.

    Raises:
        InputError: the form or a name is unknown; the nearest name is suggested.
    """
    if spec is None:
        return dict(registry)
    if not spec.startswith(_MINUS):
        raise InputError(
            [Finding("library", f"'{spec}' is not understood", "use minus:NAME")]
        )
    names = [name.strip() for name in spec.removeprefix(_MINUS).split(",")]
    check_names(names, registry, "library")
    return {name: effect for name, effect in registry.items() if name not in names}
