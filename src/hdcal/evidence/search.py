"""All hypotheses of a case: single components, pairs, and both with a remainder.

Everything is evaluated alone under every model of the noise. Then the most probable
components become contexts, one after the other, given which everything is evaluated
again; the best pairs are evaluated with a remainder.
"""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from hdcal.data.case import Case
from hdcal.evidence import noise_models
from hdcal.evidence.components import components, lacking
from hdcal.evidence.evaluation import Evaluated, select
from hdcal.evidence.items import Space
from hdcal.evidence.linear_problem import LinearProblem, linear_problem
from hdcal.evidence.noise_models import GROWING, OUTLIERS, NoiseModel
from hdcal.evidence.parameter_grid import is_excluded
from hdcal.evidence.parts import Part, join, log_sign_probability, merged, posterior
from hdcal.evidence.remainder import kernels, likeliest_members, local_families
from hdcal.evidence.row_features import (
    coarse_step,
    thin_rows,
    with_coarse_step,
)
from hdcal.evidence.table import OUTSIDE, EvidenceTable, Names
from hdcal.physics.effect import Effect

# Components given which others are evaluated; models of the noise used there, and
# their least probability.
_CONTEXTS, _MOST_NOISES, _LEAST_NOISE = 8, 2, 0.03
# Log evidence below the best given a context from which on a hypothesis is left out.
_HOPELESS = 25.0
# Pairs that are evaluated with a remainder, and hypotheses whose remainder grows.
_BEST = 3
# Most kernels of a remainder, and prior odds of one more.
_MOST_KERNELS, _ONE_MORE = 4, 0.25
# Kernels and local families that share the prior of the remainder, at least.
_LEAST_SHARING = 15
# Changes of stiffness and log noise sd from which on effects are evaluated again.
_SAME_STIFFNESS, _SAME_NOISE = 0.03, 0.3
# Rows up to which every one is kept: kernels and tolerances of 10⁴ rows take 1 GB.
_MOST_ROWS = 10_000


def search(
    case: Case, library: Mapping[str, type[Effect]], *, free_runs: bool = False
) -> "Searched":
    """Return the evidence of all hypotheses of a case, of effects by name.

    With `free_runs` each run has an unknown force offset, whatever acts.

    Raises:
        InputError: an effect has no prior.
    """
    case = thin_rows(with_coarse_step(case), _MOST_ROWS)
    problem = linear_problem(case, library, free_runs=free_runs)
    found = Searched(problem, library)
    about = _expansion(problem, found.table)
    if about is not None:
        problem = linear_problem(case, library, free_runs=free_runs, **about)
        found = Searched(problem, library, found.kernels)
    found.fitted_correlations()
    found.coarse_step = coarse_step(case, problem.noise_sd)
    # The noise of a coarse reading is not normal; no effect need explain that.
    if not found.coarse_step:
        found.other_noises()
    found.pairs()
    return found


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


class Searched:
    """All hypotheses of a case; everything alone is entered at once.

    `effects` of the library predict something for the rows; of the others some are
    `lacking` columns that were not measured, and some are `excluded` by their priors.
    `coarse_step` is that of readings on a coarse grid [N], else 0.
    """

    coarse_step = 0.0

    def __init__(
        self,
        problem: LinearProblem,
        library: Mapping[str, type[Effect]],
        known_kernels: list[Space] | None = None,
    ):
        self.problem, self.lacking = problem, lacking(library, problem.records)
        self.excluded = tuple(
            name
            for name, effect in library.items()
            if is_excluded(effect, problem.priors)
        )
        unused = {*self.lacking, *self.excluded}
        self.effects = {n: e for n, e in library.items() if n not in unused}
        self.components = effects = components(self.effects, problem)
        self.outside = len(effects.names)
        self.families = local_families(problem)
        self.kernels = known_kernels or kernels(problem, effects, self.outside)
        sharing = max(len(self.kernels) + len(self.families), _LEAST_SHARING)
        self.log_sharing = float(np.log(sharing))
        self.table = EvidenceTable(
            (*effects.names, OUTSIDE), noise_models.equal_noise(problem)
        )
        spaces, names = self._sharing(self.kernels), self.table.names
        self.selection = select(problem, self.table.noises, effects, spaces, names)
        self.found_alone: dict[int, Evaluated] = {}
        self._alone(range(len(self.table.noises)))

    def _sharing(self, spaces: Sequence[Space]) -> list[Space]:
        """Return spaces of the remainder, among which its prior is shared."""
        return [
            space._replace(log_weight=space.log_weight - self.log_sharing)
            for space in spaces
        ]

    def _evaluate(
        self,
        columns: Sequence[int],
        parts: Sequence[Part],
        only: set[int] | None = None,
    ) -> dict[int, Evaluated]:
        """Evaluate everything given some parts under several models of the noise."""
        context, local = join(self.problem, parts), []
        if only is None or self.outside in only:
            extended = self.problem.with_columns(context.offset, context.columns)
            local = likeliest_members(extended, self.families, self.outside)
            local = self._sharing(local)
        noises, evaluate = self.table.noises, self.selection.evaluate
        return {
            column: evaluate(noises[column], context, local, only) for column in columns
        }

    def _alone(self, columns: Sequence[int]) -> None:
        """Enter none and each component alone."""
        table = self.table
        for column, found in self._evaluate(columns, []).items():
            self.found_alone[column] = found
            table.put((), column, found.none, list)
            for k, value in enumerate(found.totals()):
                if np.isfinite(value):
                    part = partial(found.likeliest, k)
                    table.put((table.names[k],), column, value, lambda p=part: [p()])

    def fitted_correlations(self) -> None:
        """Enter everything alone with the correlations that two hypotheses leave.

        Where rows are many, a correlation between two of the grid may fit much better.
        """
        table, problem = self.table, self.problem
        for key in dict.fromkeys([(), table.ranked()[0]]):
            fit = posterior(problem, table.likeliest_noise(key), table.parts[key])
            known = [noise.correlation for noise in table.noises]
            error = problem.y - fit.reading
            self._add_noises(noise_models.correlated_noise(problem, error, known))

    def other_noises(self) -> None:
        """Enter everything alone under the library's models of the noise."""
        table, problem = self.table, self.problem
        likeliest = int(np.argmax(table.noise_probabilities()))
        correlation = table.noises[likeliest].correlation
        more = (
            noise_models.growing_noise(problem, correlation)
            if GROWING in self.effects
            else []
        )
        if OUTLIERS in self.effects:
            for key in dict.fromkeys([(), table.ranked()[0]]):
                parts = table.parts[key]

                def fitted(weight, parts=parts):
                    equal = NoiseModel("", weight, 0.0, 0.0)
                    return posterior(problem, equal, parts).reading

                more += noise_models.outliers(problem, correlation, fitted)
        self._add_noises(more)

    def _add_noises(self, more: list[NoiseModel]) -> None:
        """Enter everything alone under more models of the noise."""
        if more:
            count = len(self.table.noises)
            self.table.add_noises(more)
            self._alone(range(count, count + len(more)))

    def pairs(self) -> None:
        """Enter pairs, and components and pairs with a remainder."""
        table, chance = self.table, self.table.noise_probabilities()
        columns = np.argsort(-chance)[:_MOST_NOISES]
        columns = [int(k) for k in columns if chance[k] >= _LEAST_NOISE]
        leading = table.ranked(1)[:_CONTEXTS]
        if (OUTSIDE,) in table.log_evidence and (OUTSIDE,) not in leading:
            leading[-1] = (OUTSIDE,)
        if (OUTSIDE,) in table.parts:
            self._grow((OUTSIDE,), columns)
        for key in leading:
            self._extend(table.parts[key], columns)
        for key in table.ranked(2)[:_BEST]:
            if OUTSIDE not in key:
                self._extend(table.parts[key], columns, {self.outside})
        extended = [k for k in table.ranked() if OUTSIDE in k and len(k) > 1]
        for key in extended[:_BEST]:
            self._grow(key, columns[:1])

    def _grow(self, key: Names, columns: Sequence[int]) -> None:
        """Add kernels to the remainder of a hypothesis while the evidence grows."""
        table, outside = self.table, self.outside
        for _ in range(_MOST_KERNELS - 1):
            parts, before = table.parts[key], table.log_evidence[key].max()
            others = [part for part in parts if part.component != outside]
            own = [part for part in parts if part.component == outside]
            signs = {column: self._signs(column, parts) for column in columns}
            for column, found in self._evaluate(columns, parts, {outside}).items():
                more = [*others, merged([*own, found.likeliest(outside)])]
                gain = found.totals()[outside] - found.none + np.log(_ONE_MORE)
                gain += min(self._signs(column, more) - signs[column], 0.0)
                value = table.log_evidence[key][column] + gain
                table.put(key, column, value, lambda more=more: more)
            if table.log_evidence[key].max() <= before:
                return

    def _extend(
        self, parts: list[Part], columns: Sequence[int], only: set[int] | None = None
    ) -> None:
        """Enter everything, or some components, given one or an entered pair."""
        table = self.table
        key = tuple(sorted(table.names[part.component] for part in parts))
        for column, found in self._evaluate(columns, parts, only).items():
            gain, signs = found.totals() - found.none, self._signs(column, parts)
            start = table.log_evidence[key][column]
            if len(parts) == 1 and parts[0].place is not None:
                start = self.found_alone[column].of_part(parts[0])
            gain[[part.component for part in parts]] = -np.inf
            for k in np.flatnonzero(gain > gain.max() - _HOPELESS):
                names = {*key, table.names[k]}
                if len(names - {OUTSIDE}) > 2:
                    continue
                both = [*parts, found.likeliest(int(k))]
                # Another component makes signs less probable; more probable is no gain.
                change = min(self._signs(column, both) - signs, 0.0)
                value = start + gain[k] + change
                table.put(tuple(names), column, value, lambda both=both: both)

    def _signs(self, column: int, parts: list[Part]) -> float:
        """Return the log probability of the signs of one-sided amplitudes."""
        return log_sign_probability(self.problem, self.table.noises[column], parts)
