"""Checks that the effects and parameters that a user names are in the library."""

from collections.abc import Collection, Mapping, Sequence
from difflib import get_close_matches

from hdcal.data.case import Case
from hdcal.errors import Finding, Findings
from hdcal.inference.force_model.problem import MEMBER_SD
from hdcal.physics.effect import Effect, parameters
from hdcal.physics.effects.scatter import Scatter
from hdcal.physics.registry import EFFECTS


def check_names(
    names: Sequence[str], registry: Mapping[str, type[Effect]], parameter: str
) -> None:
    """Check that effects, given as some parameter, are in the library.

    Raises:
        InputError: one is not; the nearest one is suggested.
    """
    with Findings() as findings:
        for name in names:
            if name not in registry:
                problem = f"no effect is called '{name}'"
                library = f"The library holds: {', '.join(sorted(registry))}"
                remedy = f"{_nearest(name, registry)}{library}"
                findings.append(Finding(parameter, problem, remedy))


def check_effect_priors(
    case: Case, registry: Mapping[str, type[Effect]] = EFFECTS
) -> None:
    """Check the gear file's priors of effects against the library.

    Raises:
        InputError: an effect or parameter is not in the library, the unit is of
            another kind, or the spread is that of members of the model.
    """
    known = {
        f"{name}.{field}": spec.unit
        for name, effect in registry.items()
        for field, spec in parameters(effect).items()
    }
    scatter = {
        f"{name}.sd": MEMBER_SD[effect.members]
        for name, effect in registry.items()
        if issubclass(effect, Scatter)
    }
    with Findings() as findings:
        for name, prior in case.gear.effect_priors.items():
            if name in scatter:
                problem = "has its prior under another name"
                remedy = f"Give it as {scatter[name]}"
            elif name not in known:
                problem = "is no parameter of an effect in the library"
                remedy = f"{_nearest(name, known)}`hdcal effects` lists them"
            elif prior.unit not in ("", known[name]):
                problem = f"has the unit {prior.unit}, not {known[name]}"
                remedy = f"Give it in {known[name]}"
            else:
                continue
            column = f"priors.{name}"
            findings.append(Finding("gear file", problem, remedy, column=column))


def _nearest(name: str, known: Collection[str]) -> str:
    """Return a question for the nearest known name; empty if none is near."""
    near = get_close_matches(name, known, n=1)
    return f"Did you mean '{near[0]}'? " if near else ""
