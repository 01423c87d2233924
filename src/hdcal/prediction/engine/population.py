"""Whose force is asked for: of readings, mountings or gears, as read or as load."""

from typing import Literal, get_args

import equinox as eqx
import numpy as np

from hdcal.errors import Finding
from hdcal.inference.problem import Problem
from hdcal.prediction.engine.forces import Quantity

Population = Literal["readings", "mountings", "specimens"]
POPULATIONS: tuple[Population, ...] = get_args(Population)


class Whose(eqx.Module):
    """Whose force is asked for.

    Attributes:
        population: the members that differ from each other.
        quantity: which force of theirs.
        rounded: whether it is read in steps.
    """

    population: Population = eqx.field(static=True)
    quantity: Quantity = eqx.field(static=True)
    rounded: bool = eqx.field(static=True)

    def tested_gears(self, problem: Problem) -> int:
        """Return how many gears tell of a new one; 0 where the gear is a tested one."""
        return problem.specimens if self.population == "specimens" else 0

    def tested_mountings(self, problem: Problem) -> int:
        """Return how many mountings tell of a new one's zero; 0 where it has none."""
        new = self.population != "readings" and self.quantity == "reading"
        return problem.runs if new else 0


def new_member_sd(sd, tested: int):
    """Return the sd of a new member from the mean of the tested ones.

    A new one also carries the distance of that mean from the population's.

    Args:
        sd: between members, of each draw.
        tested: number of tested members.
    """
    return sd * np.sqrt(1.0 + 1.0 / tested)


def widest(problem: Problem) -> Population:
    """Return the widest population of which the data hold two members or more."""
    if problem.specimens >= 2:
        return "specimens"
    return "mountings" if problem.runs >= 2 else "readings"


def check_population(asked: str | None, problem: Problem) -> list[Finding]:
    """Return why the data say nothing of a population; empty when they do."""
    if asked is None or asked == "readings":
        return []
    if asked not in POPULATIONS:
        words = f"'{asked}' is unknown"
        return [Finding("population", words, f"Use one of {', '.join(POPULATIONS)}")]
    what, count = {
        "mountings": ("mounting (run)", problem.runs),
        "specimens": ("gear (specimen)", problem.specimens),
    }[asked]
    if count >= 2:
        return []
    words = f"the data hold one {what}, which says nothing of how much others differ"
    remedy = f"Measure two or more, or ask about {widest(problem)}"
    return [Finding("population", words, remedy)]
