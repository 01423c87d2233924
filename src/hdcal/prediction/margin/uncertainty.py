"""The uncertainty that a margin states: the linear budget, checked by Monte Carlo."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from hdcal.prediction.budget.linear import LinearCheck, check_linear, coverage_factor
from hdcal.prediction.engine.causes import independent_draws
from hdcal.prediction.engine.population_force import PopulationForce
from hdcal.prediction.margin.budget import Component, ForceBudget, averaged_budget
from hdcal.prediction.margin.budget_words import (
    check_words,
    component_label,
    halved_by,
    shown_unit,
)
from hdcal.prediction.margin.result import INTERVAL, Level
from hdcal.prediction.margin.stated import BudgetCheck, BudgetLine, StatedUncertainty


@dataclass(frozen=True)
class PredictiveLaw:
    """The force of one future member in every draw of all causes: normal components.

    Attributes:
        weight: of each component, those of a draw sum to the weight of the draw.
        mean: [N], one array [draw, component] for each cause.
        sd: [N], that of the rounding included.
    """

    weight: list[np.ndarray]
    mean: list[np.ndarray]
    sd: list[np.ndarray]

    @classmethod
    def of(cls, forces: Sequence[PopulationForce]) -> "PredictiveLaw":
        """Return the law of the forces of all causes."""
        law = cls([], [], [])
        for force in forces:
            mixture = force.mixture()
            share = force.cause.weights[:, None] * np.asarray(mixture.weight)
            law.weight.append(np.broadcast_to(share, mixture.mean.shape))
            law.mean.append(np.asarray(mixture.mean))
            law.sd.append(np.hypot(np.asarray(mixture.sd), force.rounding_sd))
        return law

    def moments(self) -> tuple[float, float]:
        """Return mean and sd [N]."""
        parts = list(zip(self.weight, self.mean, self.sd, strict=True))
        mean = sum(float(np.sum(w * m)) for w, m, _ in parts)
        variance = sum(float(np.sum(w * ((m - mean) ** 2 + s**2))) for w, m, s in parts)
        return mean, variance**0.5

    def end_error(self, ends: tuple[float, float], draws: Sequence[float]) -> float:
        """Return the larger standard error of the ends of an interval [N].

        A quantile moves by what the share below it is uncertain, over the density.

        Args:
            ends: of the interval.
            draws: how many independent ones those of each cause are worth.
        """
        _, sd = self.moments()
        errors = []
        for end in ends:
            near = sum(map(np.sum, self._below(end + 0.05 * sd)))
            density = (near - sum(map(np.sum, self._below(end - 0.05 * sd)))) / 0.1 / sd
            # Causes differ by what they are, and their draws alone by chance.
            parts = zip(self._below(end), self.weight, draws, strict=True)
            each = [
                np.sum(w) * np.std(below / w.sum(axis=1)) / np.sqrt(worth)
                for below, w, worth in parts
            ]
            errors.append(float(np.linalg.norm(each)) / max(density, 1e-300))
        return float(max(errors))

    def _below(self, force: float) -> list[np.ndarray]:
        """Return each draw's part of the probability of at most this force."""
        parts = zip(self.weight, self.mean, self.sd, strict=True)
        return [np.sum(w * ndtr((force - m) / s), axis=1) for w, m, s in parts]


def stated_uncertainty(
    forces: Sequence[PopulationForce], worst: Level, *, with_budget: bool = True
) -> StatedUncertainty:
    """Return the force of one future member with its uncertainty.

    Args:
        forces: of each cause, at the worst temperature.
        worst: the force there; its predictive interval is that of Monte Carlo.
        with_budget: with the linear budget; without it Monte Carlo speaks alone.
    """
    drawn = worst.member_N.lo, worst.member_N.hi
    law = PredictiveLaw.of(forces)
    estimate, sd = law.moments()
    if not with_budget:
        return _stated(estimate, sd, drawn, (), None, None)
    found = averaged_budget(forces)
    linear = float(np.sqrt(found.variance))
    expanded = coverage_factor(found.dof, INTERVAL) * linear
    about = found.estimate - expanded, found.estimate + expanded
    check = check_linear(about, drawn, linear)
    lines = budget_lines(found, forces)
    worth = [independent_draws(force.cause) for force in forces]
    error = law.end_error(drawn, worth)
    said = _said(found, linear, about, drawn, check, error)
    if check.valid:
        return _stated(found.estimate, linear, about, lines, True, said)
    return _stated(estimate, sd, drawn, lines, False, said)


def _stated(estimate, sd, ends, lines, valid, check) -> StatedUncertainty:
    low, high = ends
    half = 0.5 * (high - low)
    return StatedUncertainty(
        budget=lines,
        estimate_N=estimate,
        combined_standard_uncertainty_N=sd,
        coverage_factor=half / sd if sd > 0.0 else 0.0,
        expanded_uncertainty_N=half,
        coverage_lo_N=low,
        coverage_hi_N=high,
        linear_budget_valid=valid,
        linear_check=check,
    )


def _said(
    found: ForceBudget, sd: float, about, drawn, check: LinearCheck, error: float
) -> BudgetCheck:
    return BudgetCheck(
        estimate_N=found.estimate,
        standard_uncertainty_N=sd,
        degrees_of_freedom=found.dof,
        coverage_factor=coverage_factor(found.dof, INTERVAL),
        lo_N=about[0],
        hi_N=about[1],
        monte_carlo_lo_N=drawn[0],
        monte_carlo_hi_N=drawn[1],
        tolerance_N=check.tolerance,
        monte_carlo_error_N=error,
        words=check_words(about, drawn, check, error),
    )


def budget_lines(
    found: ForceBudget, forces: Sequence[PopulationForce]
) -> tuple[BudgetLine, ...]:
    """Return the rows of a budget, the largest first."""
    main = max(forces, key=lambda force: force.cause.probability)
    ranked = sorted(found.components, key=lambda part: -part.variance)
    return tuple(_line(part, found.variance, main) for part in ranked)


def _line(part: Component, total: float, force: PopulationForce) -> BudgetLine:
    unit, factor = shown_unit(part.name)
    return BudgetLine(
        component=component_label(part.name),
        type="A" if part.driven_by == "data" else "B",
        distribution=part.law,
        standard_uncertainty=factor * part.standard_uncertainty,
        unit=unit,
        sensitivity_N_per_unit=part.sensitivity / factor,
        contribution_N=float(np.sqrt(part.variance)),
        share=part.variance / total,
        halved_by=halved_by(part, force),
    )
