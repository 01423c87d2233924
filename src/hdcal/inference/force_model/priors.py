"""Priors of the sites of a force model."""

from collections.abc import Mapping, Sequence

from hdcal.data.case import Case
from hdcal.data.prior import Prior, scaled
from hdcal.data.priors import SCALE_UNITS
from hdcal.data.theory_names import SPRING, Theory
from hdcal.errors import Finding, InputError
from hdcal.physics.effect import Effect, parameters
from hdcal.physics.effects.scatter import Scatter
from hdcal.physics.theory import THEORIES

# Parameters that every model has.
SITES = ("K", "E0", "alpha", "force_offset", "deformation_offset", "sigma")


def without_scatter(effects: Sequence[type[Effect]]) -> tuple[type[Effect], ...]:
    """Return the effects that have sites: runs and specimens scatter as members."""
    return tuple(effect for effect in effects if not issubclass(effect, Scatter))


def problem_priors(
    case: Case,
    effects: Sequence[type[Effect]],
    shipped: Mapping[str, Prior],
    theory: Theory,
) -> dict[str, Prior]:
    """Return the priors of every site, K carried over to the theory in use.

    What the gear file states replaces what is shipped. `InputError` if one is missing.
    """
    gear = case.gear
    table = {**shipped, **gear.effect_priors, **gear.scale_priors, **gear.priors}
    table |= gear.gauge_priors
    names = [*SITES, *SCALE_UNITS, *gear.gauge_priors]
    for effect in without_scatter(effects):
        names += [f"{effect.name}.{field}" for field in parameters(effect)]
    if missing := [name for name in names if name not in table]:
        example = '{ family = "normal", mean = 0.0, sd = 1.0 }'
        raise InputError(
            Finding(
                case.name,
                f"no prior for {name}",
                f"add it to the gear file's [priors], e.g. {name} = {example}",
            )
            for name in missing
        )
    priors = {name: table[name] for name in names}
    priors["K"] = influence_prior(case, theory)
    return priors


def influence_prior(case: Case, theory: Theory) -> Prior:
    """Return the prior of K carried over to a theory: K_a k_a = K_b k_b.

    `InputError` if one of both is `spring`, which has another modulus.
    """
    gear = case.gear
    if (theory == SPRING) != (gear.K_theory == SPRING):
        words = f"the gear was read with '{gear.theory}', whose K is no K of '{theory}'"
        remedy = f"read the gear with the theory '{theory}'"
        raise InputError([Finding("theory", words, remedy)])
    ratio = unit_stiffness(case, gear.K_theory) / unit_stiffness(case, theory)
    return scaled(gear.priors["K"], ratio)


def unit_stiffness(case: Case, theory: Theory) -> float:
    """Return k_theory/E of the case's gear, radial [mm]."""
    return float(THEORIES[theory](case.gear.geometry, 1.0))
