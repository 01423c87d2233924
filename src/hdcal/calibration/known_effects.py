"""Checks that the effects and parameters that a user names are in the library."""

from collections.abc import Mapping, Sequence

from hdcal.data.case import Case
from hdcal.data.findings import did_you_mean
from hdcal.errors import Finding, Findings
from hdcal.inference.force_model.values import MEMBER_SD
from hdcal.physics.effect import Effect, parameters
from hdcal.physics.effects.scatter import Scatter
from hdcal.physics.registry import EFFECTS


def check_names(
    names: Sequence[str], registry: Mapping[str, type[Effect]], parameter: str
) -> None:
    """Raise `InputError` if effects, given as a parameter, are not in the library."""
    with Findings() as findings:
        for name in names:
            if name not in registry:
                problem = f"unknown effect '{name}'"
                remedy = did_you_mean(name, sorted(registry))
                findings.append(Finding(parameter, problem, remedy))


def check_effect_priors(
    case: Case, registry: Mapping[str, type[Effect]] = EFFECTS
) -> None:
    """Raise `InputError` for priors of the gear file that no effect can have."""
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
                problem = "is not the name of this prior"
                remedy = f"State it as {scatter[name]}"
            elif name not in known:
                problem = "is not a parameter of an effect in the library"
                remedy = did_you_mean(name, [*known])
            elif prior.unit not in ("", known[name]):
                problem = f"has the unit {prior.unit}, not {known[name]}"
                remedy = f"State it in {known[name]}"
            else:
                continue
            column = f"priors.{name}"
            findings.append(Finding("gear file", problem, remedy, column=column))
