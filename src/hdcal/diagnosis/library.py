"""Which effects a diagnosis considers: the library, or a part of it."""

from collections.abc import Mapping

from hdcal.calibration.known_effects import check_names
from hdcal.errors import Finding, InputError, quoted
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


def library_of(given: Mapping[str, type[Effect]] | None) -> dict[str, type[Effect]]:
    """Return effects to consider, by name; None are all of the library.

    Raises:
        InputError: they are no effects by name.
    """
    if given is None:
        return dict(EFFECTS)
    remedy = "Give effects by name, such as hdcal.EFFECTS or a part of it"
    if not isinstance(given, Mapping):
        raise InputError([Finding("library", "is no mapping", remedy)])
    wrong = [n for n, e in given.items() if not _is_effect(e)]
    if wrong:
        words = f"{quoted(str(wrong[0]))} is no class of an effect"
        raise InputError([Finding("library", words, remedy)])
    return dict(given)


def _is_effect(given: object) -> bool:
    return isinstance(given, type) and issubclass(given, Effect)
