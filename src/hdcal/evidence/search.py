"""All hypotheses of a case: made linear, evaluated alone, then extended to pairs."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Case
from hdcal.evidence.components import Components
from hdcal.evidence.hypotheses import Hypotheses
from hdcal.evidence.linear_problem import LinearProblem, linear_problem
from hdcal.evidence.noise_models import NoiseModel
from hdcal.evidence.parts import posterior
from hdcal.evidence.row_features import (
    average_rows,
    coarse_step,
    half_cycle_rows,
    thin_rows,
    with_coarse_step,
)
from hdcal.evidence.table import EvidenceTable
from hdcal.physics.effect import Effect

# Changes of stiffness and log noise sd from which on effects are evaluated again.
_SAME_STIFFNESS, _SAME_NOISE = 0.03, 0.3
# Of oversampled rows one in three is kept, while so many are left, in all and of a half
# cycle.
_STEP, _FEWEST, _FEWEST_OF_HALF = 3, 100, 5


@dataclass(frozen=True)
class Searched:
    """All hypotheses of a case, and what they were computed from.

    Attributes:
        problem: the linear problem.
        table: evidence of each hypothesis.
        effects: of the library that predict something for the rows, by name.
        lacking: columns that each of the others needs and that were not measured.
        components: of the effects.
        kernels: columns of each kernel of the remainder [N], shape (j, n).
        coarse_step: step of readings on a coarse grid [N]; 0 where there is none.
    """

    problem: LinearProblem
    table: EvidenceTable
    effects: Mapping[str, type[Effect]]
    lacking: Mapping[str, tuple[str, ...]]
    components: Components
    kernels: list[np.ndarray]
    coarse_step: float


def search(
    case: Case, library: Mapping[str, type[Effect]], *, free_runs: bool = False
) -> Searched:
    """Return the evidence of all hypotheses of a case, of effects by name.

    With `free_runs` each run has an unknown force offset, whatever acts.

    Raises:
        InputError: an effect has no prior.
    """
    case = average_rows(with_coarse_step(case))
    problem = linear_problem(case, library, free_runs=free_runs)
    found = Hypotheses(problem, library)
    if _oversampled(problem, found.table):
        return search(thin_rows(case, _STEP), library, free_runs=free_runs)
    about = _expansion(problem, found.table)
    if about is not None:
        problem = linear_problem(case, library, free_runs=free_runs, **about)
        found = Hypotheses(problem, library, found.kernels)
    found.fitted_correlations()
    step = coarse_step(case, problem.noise_sd)
    # The noise of a coarse reading is not normal; no effect need explain that.
    if not step:
        found.other_noises(library)
    found.pairs()
    return Searched(
        problem=problem,
        table=found.table,
        effects=found.effects,
        lacking=found.lacking,
        components=found.components,
        kernels=[space.columns for space in found.kernels],
        coarse_step=step,
    )


def _oversampled(problem: LinearProblem, table: EvidenceTable) -> bool:
    """Whether noise is correlated as far as the grid reaches, in many rows."""
    if int(np.argmax(table.noise_probabilities())) < len(table.noises) - 1:
        return False
    enough = len(problem.y) >= _STEP * _FEWEST
    return enough and half_cycle_rows(problem.records) >= _STEP * _FEWEST_OF_HALF


def _expansion(problem: LinearProblem, table: EvidenceTable) -> dict | None:
    """Return noise sd and stiffness given the best hypothesis, where they differ."""
    parts = table.parts[table.ranked()[0]]
    found = posterior(problem, NoiseModel("", np.ones(len(problem.y)), 0.0, 0.0), parts)
    # The first coefficient is the deviation of the log stiffness from its prior mean.
    deviation = problem.log_shift + problem.log_sd * found.mean[0]
    # Of the zeros of both channels the rows determine one.
    used = problem.X.shape[1] - 1 + sum(len(part.columns) for part in parts)
    free = len(problem.y) - used
    if free < 1:
        return None
    noise_sd = float(np.sqrt(np.sum((problem.y - found.reading) ** 2) / free))
    moved = abs(deviation) > _SAME_STIFFNESS
    louder = abs(np.log(noise_sd / problem.noise_sd)) > _SAME_NOISE
    if deviation <= -1.0 or not (moved or louder):
        return None
    stiffness = float(problem.base.stiffness) * (1.0 + deviation)
    return {"noise_sd": noise_sd, "stiffness": stiffness}
