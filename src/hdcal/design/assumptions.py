"""What every design takes for granted, in words."""

from hdcal.design.design_draws import DesignDraws

_CARRIED = (
    "K is carried over from {gear} to other sizes. That holds for gears of the same "
    "proportions of teeth, end and wall; the farther away, the less."
)
_OF_THE_GEAR = (
    "Deformation is that of the gear itself, radial and from its free shape; the rig's "
    "zeros and its own compliance are left out. `hdcal predict` and `hdcal margin` say "
    "what the rig reads at a deformation as read, which differs by these zeros."
)
_PRIOR_ONLY = (
    "Prior only: no gear was measured. Every interval is what is believed before any "
    "data, mostly of K."
)


def assumptions(draws: DesignDraws) -> list[str]:
    """Return what every answer from these draws takes for granted."""
    words = [_CARRIED.format(gear=draws.known_as), _OF_THE_GEAR]
    if draws.kind == "prior":
        words.insert(0, _PRIOR_ONLY)
    if draws.material != draws.gear.material:
        words.append(
            f"Modulus and its loss with temperature are handbook values of "
            f"{draws.material}; K is taken not to depend on the material."
        )
    force = [e.name for e in draws.problem.effects if e.stage == "force"]
    if force:
        words.append(
            f"The calibrated {', '.join(force).replace('_', ' ')} is carried over "
            "to other sizes as it is."
        )
    if any("unloading" in effect.needs for effect in draws.problem.effects):
        words.append(
            "Every force is that of loading. By the calibrated effects a gear that "
            "comes to its place by unloading takes another force, or rests elsewhere."
        )
    if draws.problem.discrepancy is not None:
        words.append("The leftover discrepancy is taken to grow with stiffness.")
    return words
