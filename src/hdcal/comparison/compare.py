"""Comparison of the stiffness of several results."""

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from pydantic import Field, computed_field

from hdcal.comparison.charts import stiffness_chart
from hdcal.data.case import Case
from hdcal.data.plausible import implausible
from hdcal.errors import Finding, Findings, InputError
from hdcal.prediction.engine.causes import Cause, causes_of
from hdcal.prediction.engine.models import Models
from hdcal.report.chart_spec import Chart
from hdcal.report.item import (
    INTERVAL,
    Count,
    Draws,
    Interval,
    Item,
    Probability,
    Words,
    quantity,
)
from hdcal.report.result import Result
from hdcal.report.words import label
from hdcal.versions import versions

# Draws of each result that are compared with those of the others.
_DRAWS = 4000
# More results make a table that nobody reads.
MOST = 1000


class Compared(Item):
    """One result with its difference from the first; 95 % credible intervals."""

    name: Words = quantity("result", column="gear")
    rows: Count = quantity("readings")
    stiffness_N_per_mm: Interval = quantity("stiffness as read", "N/mm")
    difference_N_per_mm: Interval = quantity("difference from the first", "N/mm")
    difference_percent: Interval = quantity("difference from the first", "%")
    probability_stiffer: Probability = quantity("probability of being stiffer")
    probability_differs: Probability | None = quantity(
        "probability of a difference larger than the tolerance"
    )

    @property
    def differs(self) -> bool:
        """Whether the interval of the difference excludes zero."""
        return not self.difference_percent.lo <= 0.0 <= self.difference_percent.hi


class Comparison(Result):
    """Stiffness of several results, and its difference from that of the first.

    Attributes:
        results: in the given order; the first one is the reference.
        tolerance_N_per_mm: difference that matters; None where none was given.
        interval: probability that every interval holds.
        seed: of the pairs of draws.
        versions: of the packages that made it.
        stiffness: draws of each result, shape (n, t) [N/mm as read].
        data: SHA-256 of the data by the names of results.
        effects: in the models, by the names of results.
        temperatures: reference temperatures by the names of results [°C].
        certified: whether certificates of gauges are in an interval.
    """

    template = "comparison/report.md.j2"
    table = "results"

    format: Literal["hdcal.compare/1"] = "hdcal.compare/1"
    results: tuple[Compared, ...]
    tolerance_N_per_mm: float | None = quantity("tolerance", "N/mm")
    interval: float = Field(default=INTERVAL, gt=0.0, lt=1.0)
    seed: Count
    versions: dict[str, str]
    stiffness: Draws
    data: dict[str, str] = Field(exclude=True)
    effects: dict[str, str] = Field(exclude=True)
    temperatures: dict[str, float] = Field(exclude=True)
    certified: bool = Field(exclude=True)

    @computed_field
    @property
    def notes(self) -> tuple[Words, ...]:
        """Limits of the comparison."""
        return self.lines("notes")

    @property
    def ranked(self) -> list[Compared]:
        """The other results: first those that differ, the largest difference first."""
        return sorted(
            self.results[1:],
            key=lambda one: (not one.differs, -abs(one.difference_percent.median)),
        )

    def make_charts(self) -> Mapping[str, Chart]:
        """Return the stiffness of every result."""
        return {"results": stiffness_chart(self.results, self.units)}


def compare(
    results: Mapping[str, Models],
    *,
    tolerance: float | None = None,
    seed: int = 0,
) -> Comparison:
    """Compare the stiffness of finished results with that of the first.

    Posteriors of different data are independent: a draw of one is paired with any draw
    of another.

    Args:
        results: what `calibrate` or `diagnose` returned, by name.
        tolerance: difference of stiffness that matters [N/mm as read].
        seed: of the pairs.

    Raises:
        InputError: there are fewer than two, or their readings differ in kind.
        NotUsable: a result failed its checks.
    """
    with Findings() as wrong:
        wrong += implausible("tolerance", tolerance, "rate")
        wrong += implausible("seed", seed)
        named = {str(name) for name in results} if isinstance(results, Mapping) else ()
        if not 2 <= len(named) <= MOST or len(named) < len(results):
            words = f"a comparison takes 2 to {MOST} results by their names"
            remedy = "Give them as {'before': result, 'after': result}"
            wrong.append(Finding("results", words, remedy))
    causes = {str(name): _causes(str(name), one) for name, one in results.items()}
    cases = {name: models[0].posterior.case for name, models in causes.items()}
    _require_same_reading(cases)
    rng = np.random.default_rng(seed)
    stiffness = np.stack([_draws(models, rng) for models in causes.values()])
    return Comparison(
        results=tuple(
            _compared(name, len(case.records.force), draws, stiffness[0], tolerance)
            for (name, case), draws in zip(cases.items(), stiffness, strict=True)
        ),
        tolerance_N_per_mm=tolerance,
        units=next(iter(cases.values())).units,
        seed=seed,
        versions=versions(),
        stiffness=stiffness,
        data={name: case.data_sha256 for name, case in cases.items()},
        effects={name: _effects(models) for name, models in causes.items()},
        temperatures={n: case.gear.reference_temperature for n, case in cases.items()},
        certified=any(case.gear.gauge_priors for case in cases.values()),
    )


def _compared(
    name: str,
    rows: int,
    draws: np.ndarray,
    first: np.ndarray,
    tolerance: float | None,
) -> Compared:
    apart = draws - first
    beyond = None if tolerance is None else float(np.mean(np.abs(apart) > tolerance))
    return Compared(
        name=name,
        rows=rows,
        stiffness_N_per_mm=Interval.of(draws),
        difference_N_per_mm=Interval.of(apart),
        difference_percent=Interval.of(100.0 * apart / first),
        probability_stiffer=float(np.mean(apart > 0.0) + np.mean(apart == 0.0) / 2.0),
        probability_differs=beyond,
    )


def _causes(name: str, result: Models) -> tuple[Cause, ...]:
    """Return the models of a result.

    Raises:
        InputError: it is not a calibrated model.
        NotUsable: it failed its checks.
    """
    try:
        return causes_of(result)
    except (TypeError, ValueError, AttributeError) as error:
        words = f"{name} is not a calibrated model"
        remedy = "Give what calibrate or diagnose returned"
        raise InputError([Finding("results", words, remedy)]) from error


def _draws(models: Sequence[Cause], rng: np.random.Generator) -> np.ndarray:
    """Return draws of the stiffness over all models, in any order [N/mm as read]."""
    parts = [
        np.resize(
            rng.permutation(model.values["stiffness"]),
            round(_DRAWS * model.probability) + 1,
        )
        for model in models
    ]
    return rng.permutation(np.concatenate(parts))[:_DRAWS]


def _require_same_reading(cases: Mapping[str, Case]) -> None:
    """Check that all results are of one kind: forces or torques, radius or diameter.

    Raises:
        InputError: they were not.
    """
    loads = {case.units.load for case in cases.values()}
    if len(loads) > 1:
        words = "hold stiffnesses over deformations and over angles"
        raise InputError([Finding("results", words, "Give results of one kind")])
    readings = {name: case.gear.reading for name, case in cases.items()}
    if len(set(readings.values())) > 1:
        kinds = ", ".join(f"{name} is {how}" for name, how in readings.items())
        words = f"differ in how the deformation was read: {kinds}"
        remedy = "Read both along the radius, or both along the diameter"
        raise InputError([Finding("results", words, remedy)])


def _effects(causes: Sequence[Cause]) -> str:
    """Return the effects in the models of a result."""
    effects = {label(e.name) for one in causes for e in one.posterior.effects}
    return " and ".join(sorted(effects)) or "none"
