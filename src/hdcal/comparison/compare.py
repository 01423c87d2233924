"""Comparison of the stiffness of several results."""

from collections.abc import Mapping
from typing import Literal

import numpy as np
from pydantic import Field, InstanceOf, computed_field

from hdcal.data.case import Case
from hdcal.data.plausible import implausible
from hdcal.errors import Finding, Findings, InputError
from hdcal.prediction.models import Models, joint_draws, models_of
from hdcal.report.charts.chart_spec import ORANGE, Chart, Panel, Points
from hdcal.report.item import Count, Draws, Interval, Item, Probability, Words, quantity
from hdcal.report.result import Result
from hdcal.report.words import label
from hdcal.versions import versions

# Draws of each result that are compared with those of the others.
_DRAWS = 4000
# Ends of tested ranges that differ by more than this share of the widest range.
_OTHER_RANGE = 0.2


class Compared(Item):
    """One result with its difference from the first; 95 % credible intervals."""

    name: Words = quantity("result", column="gear")
    rows: Count = quantity("readings")
    effects: str = quantity("effects in the models")
    stiffness_N_per_mm: Interval = quantity("stiffness as read", "N/mm")
    difference_N_per_mm: Interval = quantity("difference from the first", "N/mm")
    difference_percent: Interval = quantity("difference from the first", "%")
    probability_stiffer: Probability = quantity("probability of being stiffer")
    probability_differs: Probability | None = quantity(
        "probability of a difference larger than the tolerance"
    )
    case: InstanceOf[Case] = Field(exclude=True)
    has_discrepancy: bool = Field(exclude=True)

    @property
    def tested(self) -> tuple[float, float]:
        """Least and largest deformation of the readings [mm]."""
        at = np.asarray(self.case.records.deformation)
        return float(at.min()), float(at.max())

    @property
    def differs(self) -> bool:
        """Whether the interval of the difference excludes zero."""
        return not self.difference_percent.lo <= 0.0 <= self.difference_percent.hi


class Comparison(Result):
    """Stiffness of several results, and its difference from that of the first.

    The draws of the stiffness have the shape (results, draws) [N/mm as read].
    """

    template = "comparison/report.md.j2"
    table = "results"

    format: Literal["hdcal.compare/1"] = "hdcal.compare/1"
    results: tuple[Compared, ...]
    tolerance_N_per_mm: float | None = quantity("tolerance", "N/mm")
    interval: float = 0.95
    versions: dict[str, str] = Field(default_factory=versions)
    stiffness: Draws

    @property
    def ranges_differ(self) -> bool:
        """Whether the tested ranges differ by more than a fifth of the widest one."""
        ends = np.array([result.tested for result in self.results])
        widest = np.max(np.ptp(ends, axis=1))
        return bool(np.max(np.ptp(ends, axis=0)) > _OTHER_RANGE * widest)

    @computed_field
    @property
    def notes(self) -> tuple[Words, ...]:
        """Limits of the comparison."""
        return self.lines("notes")

    def make_charts(self) -> Mapping[str, Chart]:
        """Return the stiffness of every result."""
        spans = [result.stiffness_N_per_mm for result in self.results]
        median, low, high = np.transpose([(s.median, s.lo, s.hi) for s in spans])
        x, label = np.arange(1.0, len(spans) + 1.0), "median and 95 % credible interval"
        points = Points(label=label, x=x, y=median, low=low, high=high, colour=ORANGE)
        axis = f"{self.units.stiffness} as read [{self.units.stiffness_unit}]"
        names = [result.name for result in self.results]
        panel = Panel(x="result", y=axis, marks=[points], names=names)
        return {"results": Chart(panels=[panel])}


def compare(
    results: Mapping[str, Models], *, tolerance: float | None = None
) -> Comparison:
    """Compare the stiffness of finished results with that of the first.

    Posteriors of different data are independent: a draw of one is paired with any draw
    of another.

    Args:
        results: what `calibrate` or `diagnose` returned, by name.
        tolerance: difference of stiffness that matters [N/mm as read].

    Raises:
        InputError: there are fewer than two, or their readings differ in kind.
        NotUsable: a result failed its checks.
    """
    with Findings() as wrong:
        wrong += implausible("tolerance", tolerance, "spring_stiffness")
        if len(results) < 2:
            words, remedy = "two or more are compared", "Give another result"
            wrong.append(Finding("results", words, remedy))
        models = {name: models_of(result) for name, result in results.items()}
    cases = {name: each[0].posterior.case for name, each in models.items()}
    kinds = {n: (c.units.displacement, c.gear.reading) for n, c in cases.items()}
    if len(set(kinds.values())) > 1:
        listed = ", ".join(f"{name} is {kind}" for name, (_, kind) in kinds.items())
        words = f"are stiffnesses over different readings: {listed}"
        raise InputError([Finding("results", words, "Give results of one kind")])
    rng = np.random.default_rng(0)
    drawn = [joint_draws(each, "stiffness", _DRAWS) for each in models.values()]
    stiffness = np.stack([rng.permutation(draws) for draws in drawn])
    rows = zip(models.items(), stiffness, strict=True)
    return Comparison(
        results=tuple(
            _compared(name, averaged, draws, draws - stiffness[0], tolerance)
            for (name, averaged), draws in rows
        ),
        tolerance_N_per_mm=tolerance,
        units=next(iter(cases.values())).units,
        stiffness=stiffness,
    )


def _compared(name, models, draws, apart, tolerance: float | None) -> Compared:
    """Return a result, from draws of its stiffness and of its difference."""
    # Effects on the noise do not change the stiffness.
    effects = {
        label(effect.name)
        for model in models
        for effect in model.posterior.effects
        if effect.stage != "noise"
    }
    case = models[0].posterior.case
    beyond = None if tolerance is None else float(np.mean(np.abs(apart) > tolerance))
    return Compared(
        name=name,
        rows=len(case.records.force),
        effects=" and ".join(sorted(effects)) or "none",
        stiffness_N_per_mm=Interval.of(draws),
        difference_N_per_mm=Interval.of(apart),
        difference_percent=Interval.of(100.0 * apart / (draws - apart)),
        probability_stiffer=float(np.mean(apart > 0.0) + np.mean(apart == 0.0) / 2.0),
        probability_differs=beyond,
        case=case,
        has_discrepancy=any(
            model.posterior.problem.discrepancy is not None for model in models
        ),
    )
