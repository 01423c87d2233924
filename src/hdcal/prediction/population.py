"""Populations whose members have a force: readings, mountings or gears."""

from typing import Literal, get_args

from hdcal.errors import Finding
from hdcal.inference.force_model.problem import Problem

Population = Literal["readings", "mountings", "specimens"]
POPULATIONS: tuple[Population, ...] = get_args(Population)


def widest(problem: Problem) -> Population:
    """Return the widest population of which the data hold two members or more."""
    if problem.specimens >= 2:
        return "specimens"
    return "mountings" if problem.runs >= 2 else "readings"


def population_findings(asked: str | None, problem: Problem) -> list[Finding]:
    """Return why the data cannot describe a population; empty where they can."""
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
    words = f"the data hold one {what}, which does not show how much others differ"
    remedy = f"Measure two or more, or ask about {widest(problem)}"
    return [Finding("population", words, remedy)]
