"""What is asked of a margin."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdcal.data.case import Case
from hdcal.prediction.engine.conditions import Direction, usual_temperature
from hdcal.prediction.engine.forces import Quantity
from hdcal.prediction.engine.population import Population
from hdcal.prediction.engine.reading_grid import ReadingGrid
from hdcal.prediction.margin.stated import Rule


@dataclass(frozen=True)
class Criteria:
    """What the bounds and the capacity have to keep.

    Attributes:
        content: share of the population within each bound.
        confidence: of each bound.
        required_probability: that a capacity is to meet; None for the content.
        limit_force: capacity [N], or None; once it is checked, its size.
        rule: of the decision about it, or None for guarded.
    """

    content: float
    confidence: float
    required_probability: float | None
    limit_force: float | None
    rule: Rule | None = None

    @property
    def required(self) -> float:
        """Probability that a capacity is to meet."""
        asked = self.required_probability
        return self.content if asked is None else asked

    def of_size(self) -> "Criteria":
        """Return the same with the size of the capacity."""
        limit = self.limit_force
        return self if limit is None else replace(self, limit_force=abs(limit))

    def before_rounding(self, grid: ReadingGrid) -> "Criteria":
        """Return the same about the force before it is rounded; for a size."""
        if self.limit_force is None:
            return self
        return replace(self, limit_force=grid.unrounded(self.limit_force))


@dataclass(frozen=True)
class MarginRequest:
    """Whose force, and under which conditions; attributes are those of `margin`."""

    deformation: float
    temperature: float | Sequence[float] | np.ndarray | None
    direction: Direction
    tolerances: Mapping[str, float]
    population: Population | None
    quantity: Quantity
    given_force: float | None
    seed: int

    def temperatures(self, case: Case) -> np.ndarray:
        """Return all temperatures that are asked for [°C]."""
        asked = self.temperature
        asked = usual_temperature(case) if asked is None else asked
        return np.atleast_1d(np.asarray(asked, dtype=float))
