"""What the dynamic model samples, in which order, and what was known of it before."""

from collections.abc import Sequence

from hdcal.data.case import Case, Gear
from hdcal.data.prior import Prior, scaled
from hdcal.data.priors import effect_priors
from hdcal.data.theory_names import SPRING, Theory
from hdcal.errors import Finding, InputError
from hdcal.exported import jit
from hdcal.inference.problem import case_reading, influence_prior
from hdcal.physics.dynamics import ring_mass
from hdcal.physics.effect import Effect, parameters
from hdcal.physics.effects.loops import CoulombFriction

# In the order in which they are sampled and reported; K and E0 come first.
SITES = (
    "alpha",
    "mass",
    "damping_ratio",
    "deformation_offset",
    "initial_deformation",
    "initial_velocity",
    "deformation_sigma",
)
_ring_mass = jit(ring_mass, static_argnames=("radial_per_read",))
FRICTION = f"{CoulombFriction.name}.force"


def mass_prior(gear: Gear, radial_per_read: float) -> Prior:
    """Return the prior of the moved mass per displacement as read [N·s²/mm].

    Raises:
        InputError: it rests on the material's density, which is not known.
    """
    if "mass" in gear.dynamic_priors:
        return gear.dynamic_priors["mass"]
    if gear.theory == SPRING:
        words = "the theory 'spring' uses no sizes, which a mass follows from"
        raise InputError([Finding(gear.name, words, "Add mass to its [priors]")])
    if gear.density is None or "mass_ratio" not in gear.dynamic_priors:
        words = "no density of the material is known, so nor is the moved mass"
        remedy = "Add [density] to the material, or mass to the gear file's [priors]"
        raise InputError([Finding(gear.material, words, remedy)])
    read = {"radial_per_read": radial_per_read}
    ring = float(_ring_mass(gear.geometry, gear.density, **read))
    prior = scaled(gear.dynamic_priors["mass_ratio"], ring)
    source = f"{1e3 * ring:.3g} kg move on a bare ring; {prior.source}"
    return Prior(prior.family, prior.numbers, "N*s^2/mm", source)


def dynamic_sites(case: Case, effects: Sequence[type[Effect]]) -> list[str]:
    """Return the names of all sites."""
    own = [
        f"{effect.name}.{field}" for effect in effects for field in parameters(effect)
    ]
    return ["K", "E0", *case.gear.gauge_priors, *SITES, *own]


def dynamic_site_priors(
    case: Case, theory: Theory, effects: Sequence[type[Effect]] = ()
) -> dict[str, Prior]:
    """Return the priors of every site of the dynamic model.

    Raises:
        InputError: the moved mass has none.
    """
    gear = case.gear
    table = {**effect_priors(gear.full_scale), **gear.effect_priors, **gear.priors}
    table |= {**gear.dynamic_priors, **gear.gauge_priors}
    table["mass"] = mass_prior(gear, case_reading(case).radial_per_read)
    table["K"] = influence_prior(case, theory)
    return {name: table[name] for name in dynamic_sites(case, effects)}
