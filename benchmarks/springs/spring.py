"""One simulated spring: its stiffness, its test and the record of it."""

from dataclasses import dataclass, field

import numpy as np

# Smallest number of rows on the straight part from which a stiffness can be asked.
FEWEST = 8


@dataclass
class Spring:
    """A spring under test, before and after faults act on its record.

    Attributes:
        stiffness: slope of the elastic straight part [N/mm].
        deformation: true deformation by row [mm].
        force: true force by row [N].
        straight: rows on the elastic straight part.
        stroke: largest deformation [mm].
        noise: sd of the force reading [N].
        time: of each row [s].
        faults: names of the faults, with their sizes.
        segments: first and last row + 1 of parts of the record, by name.
        answer: whether a stiffness exists.
    """

    stiffness: float
    deformation: np.ndarray
    force: np.ndarray
    straight: np.ndarray
    stroke: float
    noise: float
    time: np.ndarray
    faults: dict[str, float] = field(default_factory=dict)
    segments: dict[str, list[int]] = field(default_factory=dict)
    answer: bool = True

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.force)

    @property
    def largest(self) -> float:
        """Force of the straight spring at full stroke [N]."""
        return self.stiffness * self.stroke

    @property
    def truth(self) -> float | None:
        """The stiffness, None where no answer exists."""
        return self.stiffness if self.answer and self.straight.sum() >= FEWEST else None

    def keep(self, rows: np.ndarray) -> None:
        """Keep some rows only."""
        for name in ("deformation", "force", "straight", "time"):
            setattr(self, name, getattr(self, name)[rows])


def straight_spring(rng: np.random.Generator) -> Spring:
    """Return a faultless spring, loaded, and in half of the tests unloaded too."""
    while True:
        stiffness = 10 ** rng.uniform(-2.0, 6.0)
        stroke = 10 ** rng.uniform(-1.7, 2.3)
        if 0.05 <= stiffness * stroke <= 5e6:
            break
    rows = round(10 ** rng.uniform(np.log10(15), np.log10(4000)))
    turns = int(rng.choice([0, 1, 3], p=[0.5, 0.35, 0.15]))
    phase = np.linspace(0.0, turns + 1.0, rows)
    path = 1.0 - np.abs(phase % 2.0 - 1.0)
    if rng.random() < 0.3:  # uneven steps, as of a hand wheel
        steps = np.abs(np.diff(phase, prepend=0.0)) * rng.uniform(0.3, 1.7, rows)
        path = 1.0 - np.abs(np.cumsum(steps) % 2.0 - 1.0)
    deformation = path * stroke
    largest = stiffness * stroke
    return Spring(
        stiffness,
        deformation,
        stiffness * deformation,
        np.ones(rows, bool),
        stroke,
        largest * 10 ** rng.uniform(-4.0, -2.0),
        np.arange(rows) * 10 ** rng.uniform(-2.0, 0.3),
    )


def moved_up(spring: Spring) -> np.ndarray:
    """Return +1 for each row that was loaded to, -1 for each unloaded to."""
    steps = np.sign(np.diff(spring.deformation, prepend=spring.deformation[0] - 1.0))
    return np.where(steps == 0.0, 1.0, steps)
