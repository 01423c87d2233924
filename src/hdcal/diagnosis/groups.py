"""Which group of causes leads: effects that this loading cannot tell apart."""

from collections.abc import Container, Mapping
from dataclasses import dataclass

from hdcal.diagnosis.model_posterior import ModelPosterior
from hdcal.physics.effect import Effect

# Members of a group that are this probable within it have a say in what looks alike.
_PLAUSIBLE = 0.1
# What is more likely than not.
_LIKELY = 0.5
JOINED = " / "


@dataclass(frozen=True)
class LeadingGroup:
    """The most probable group.

    Attributes:
        name: of `physics.groups`; several joined where this loading cannot part them.
        members: effects of it that were considered.
        probability: that one of its members is in the hypothesis.
    """

    name: str
    members: tuple[str, ...]
    probability: float


def group_probabilities(
    posterior: ModelPosterior, library: Mapping[str, type[Effect]]
) -> dict[str, float]:
    """Return the probability of each group: of all hypotheses that hold a member."""
    members = _members(posterior, library)
    return {group: _probability(posterior, names) for group, names in members.items()}


def identified(
    posterior: ModelPosterior,
    library: Mapping[str, type[Effect]],
    effect: str,
) -> float:
    """Return the probability of hypotheses that hold an effect and no lookalike of it.

    Two effects of one group together are a way to say the shape of a third.

    Args:
        posterior: over hypotheses.
        library: effects by name.
        effect: one of them.
    """
    total = 0.0
    for name, share in posterior.probabilities.items():
        parts = [part for part in name.split("+") if part in library]
        groups = [group for part in parts for group in library[part].groups]
        if effect in parts and len({*groups}) == len(groups):
            total += share
    return total


def ranked_effects(posterior: ModelPosterior, on_noise: Container[str]) -> list[str]:
    """Return the effects, the most probable first.

    What moves the mean goes before what shapes the noise where it is more likely than
    not: a coarse display is no cause of a bend.
    """

    def order(name: str) -> tuple[bool, float]:
        chance = posterior.inclusion[name]
        return name in on_noise or chance < _LIKELY, -chance

    return sorted(posterior.inclusion, key=order)


def leading_group(
    posterior: ModelPosterior,
    library: Mapping[str, type[Effect]],
    inseparable: tuple[tuple[str, str], ...],
    on_noise: Container[str] = (),
) -> LeadingGroup | None:
    """Return the most probable group, joined by what looks like its likely members.

    Args:
        posterior: over hypotheses.
        library: effects by name.
        inseparable: pairs of effects that this loading can never tell apart.
        on_noise: effects that shape the noise only.
    """
    members = _members(posterior, library)
    if not members:
        return None
    chances = {group: _probability(posterior, own) for group, own in members.items()}
    moving = {
        group: chance
        for group, chance in chances.items()
        if chance >= _LIKELY and any(n not in on_noise for n in members[group])
    }
    name = max(moving or chances, key=lambda group: chances[group])
    own = members[name]
    most = max(posterior.inclusion[effect] for effect in own)
    likely = {n for n in own if posterior.inclusion[n] >= _PLAUSIBLE * most}
    alike = {two for pair in inseparable for two in pair if likely & {*pair}} - {*own}
    joined = [n for n in posterior.inclusion if n in alike]
    others = [
        group
        for group, names in members.items()
        if group != name and any(name not in own for name in alike & {*names})
    ]
    together = (*own, *joined)
    return LeadingGroup(
        JOINED.join([name, *others]), together, _probability(posterior, together)
    )


def _members(
    posterior: ModelPosterior, library: Mapping[str, type[Effect]]
) -> dict[str, tuple[str, ...]]:
    """Return the effects of each group that have a probability."""
    found: dict[str, tuple[str, ...]] = {}
    for name in posterior.inclusion:
        for group in library[name].groups:
            found[group] = (*found.get(group, ()), name)
    return found


def _probability(posterior: ModelPosterior, members: tuple[str, ...]) -> float:
    own = {*members}
    return sum(p for n, p in posterior.probabilities.items() if own & {*n.split("+")})
