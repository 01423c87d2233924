"""Effects that a diagnosis considers: the library, or a part of it."""

from collections.abc import Mapping

from hdcal.calibration.known_effects import check_names
from hdcal.errors import Finding, InputError
from hdcal.physics.effect import Effect
from hdcal.physics.registry import EFFECTS

_MINUS = "minus:"


def choose_library(spec: str | None = None) -> dict[str, type[Effect]]:
    """Return the library without the effects of `minus:NAME[,NAME…]`.

    Raises:
        InputError: the form or a name is unknown; the nearest name is suggested.
    """
    if spec is None:
        return dict(EFFECTS)
    if not spec.startswith(_MINUS):
        words = f"'{spec}' is not a choice of effects"
        raise InputError([Finding("library", words, "Write minus:NAME")])
    names = [name.strip() for name in spec.removeprefix(_MINUS).split(",")]
    check_names(names, EFFECTS, "library")
    return {name: effect for name, effect in EFFECTS.items() if name not in names}


def library_of(given: Mapping[str, type[Effect]] | None) -> dict[str, type[Effect]]:
    """Return effects to consider, by name; None are all of the library.

    Raises:
        InputError: they are no effects by name.
    """
    if given is None:
        return dict(EFFECTS)
    if isinstance(given, Mapping) and all(
        isinstance(effect, type) and issubclass(effect, Effect)
        for effect in given.values()
    ):
        return dict(given)
    words, remedy = (
        "is not a mapping of effect classes",
        "Give hdcal.EFFECTS or a part of it",
    )
    raise InputError([Finding("library", words, remedy)])
