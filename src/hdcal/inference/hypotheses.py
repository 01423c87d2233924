"""What a posterior file of a diagnosis says of hypotheses, and whether that is whole.

In the file of one model `diagnosis` among its settings names it and says how probable
each of the calibrated models is. In that of their mixture each draw has a hypothesis: a
coordinate of the dimension draw, the same in every chain. What a draw's hypothesis
does not hold is at its null value there, so that the draws together are those of one
model that holds all of the effects, for whoever knows nothing of hypotheses.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hdcal.data.typed_json import STRICT, Name, Share
from hdcal.inference.array_tree import DRAW, Group
from hdcal.inference.problem import without_scatter
from hdcal.physics.effect import Effect, parameters

# The coordinate of the draws of a mixture.
HYPOTHESIS = "hypothesis"
# Settings of a posterior: its hypothesis, and what was never calibrated.
ORIGIN, LEFT_OUT = "diagnosis", "left_out"
NONE, UNKNOWN = "none", "unknown"
GAP = ("gap_sd", "gap_weights")
_ROUNDING = 1e-6


@dataclass(frozen=True)
class HeldOrigin:
    """What a diagnosis knows of a calibrated model.

    Attributes:
        hypothesis: of the model; None of the mixture of all.
        probabilities: of all that were calibrated.
    """

    __pydantic_config__: ClassVar = STRICT
    hypothesis: Name | None
    probabilities: dict[Name, Share]

    def __post_init__(self) -> None:
        if not 0.0 < sum(self.probabilities.values()) <= 1.0 + _ROUNDING:
            raise ValueError("has probabilities that do not sum to 1")
        if self.hypothesis not in (None, *self.probabilities):
            raise ValueError("is of a hypothesis without a probability")


@dataclass(frozen=True)
class LeftOut:
    """Hypotheses of a diagnosis that were not calibrated, or whose calibration failed.

    Attributes:
        probability: of them all.
        counted_as: the calibrated hypothesis that carries their probability beside its
            own.
    """

    __pydantic_config__: ClassVar = STRICT
    probability: Share
    counted_as: Name


def parts_of(hypothesis: str) -> frozenset[str]:
    """Return the effects of a hypothesis, and `unknown` where something else is."""
    return frozenset(hypothesis.split("+")) - {NONE}


def null_sites(effects: Sequence[type[Effect]]) -> Iterator[tuple[str, float]]:
    """Yield the sites of the amplitudes of effects, with their null values.

    How much members scatter is in every model that has them: no site of an effect.
    """
    for effect in without_scatter(effects):
        for name, spec in parameters(effect).items():
            if spec.null is not None:
                yield f"{effect.name}.{name}", spec.null


def check_hypotheses(
    draws: Group,
    effects: Sequence[type[Effect]],
    probabilities: Mapping[str, float],
) -> None:
    """Check that draws with hypotheses are a mixture, whoever wrote them.

    Args:
        draws: the group posterior, whole.
        effects: of the model.
        probabilities: of each hypothesis.

    Raises:
        ValueError: they are none.
    """
    axes, labels, _ = draws[HYPOTHESIS]
    if axes != (DRAW,) or labels.dtype.kind not in "OTU":
        raise ValueError("has hypotheses that are not those of draws")
    names = np.asarray(labels, str)
    if {*names.tolist()} != {*probabilities}:
        raise ValueError("has draws of other hypotheses than it says")
    known = {effect.name for effect in effects} | {UNKNOWN}
    for name in probabilities:
        own, rows = parts_of(name), names == name
        if not own <= known:
            raise ValueError(f"has a hypothesis {name} of effects that it lacks")
        absent = [effect for effect in effects if effect.name not in own]
        nulls = dict(null_sites(absent))
        if UNKNOWN not in own:
            nulls |= {site: 0.0 for site in GAP if site in draws}
        for site, null in nulls.items():
            if (draws[site].values[:, rows] != null).any():
                raise ValueError(f"has {site} in draws of {name}")
