"""The evidences of one case and what they were computed from."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Float

from hdcal.evidence.noise_evidence import NoiseEvidence
from hdcal.evidence.piecewise_effect import PiecewiseEffect
from hdcal.evidence.prepare import PreparedCase
from hdcal.evidence.single_evidence import SingleEvidence
from hdcal.evidence.subspaces import SubspaceEvidence
from hdcal.inference.model_average import NONE as NONE
from hdcal.inference.model_average import UNKNOWN as UNKNOWN

QUANTISATION = "quantisation"
# Squared length in noise sds below which an effect of large physical size is unseen.
LEAST_SEEN = 6.0
# Correlations of less weight than this take no part in what is costly.
_LEAST_WEIGHT = 0.02


@dataclass(frozen=True)
class CaseEvidence:
    """Log evidences and what they were computed from.

    Attributes:
        prepared: the case.
        piecewise: effects on the mean with one amplitude.
        single: their evidences.
        subspaces: effects with several columns, then kernels of unknown structure.
        subspace_effects: names of the effects with several columns.
        kernel_names: of the unknown structure.
        noise: effects on the noise.
        rounding_step: of the grid of readings [N], 0 = none.
        table: log evidence of each hypothesis by name, [correlation].
        scatter: those of `subspace_effects` whose members differ.
        not_testable: effect → features that the records lack.
        not_excited: effects that this loading cannot show at a physical size.
        accounted: effects that the gear file already accounts for.
        closed: of each effect beside which a remainder was looked for, draws of the
            share of the gap that it closes, shape (d,).
        unseen: of each pair of a likely effect, how probably that effect acts alone,
            the other one being too small to be seen.
    """

    prepared: PreparedCase
    piecewise: tuple[PiecewiseEffect, ...]
    single: SingleEvidence
    subspaces: SubspaceEvidence
    subspace_effects: tuple[str, ...]
    kernel_names: tuple[str, ...]
    noise: dict[str, NoiseEvidence]
    rounding_step: float
    table: dict[str, np.ndarray]
    scatter: tuple[str, ...]
    not_testable: dict[str, tuple[str, ...]] = field(default_factory=dict)
    not_excited: tuple[str, ...] = ()
    accounted: tuple[str, ...] = ()
    closed: dict[str, Float[np.ndarray, " d"]] = field(default_factory=dict)
    unseen: dict[str, dict[str, float]] = field(default_factory=dict)

    @cached_property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that take part."""
        return tuple(n for n in self.table if n not in (NONE, UNKNOWN) and "+" not in n)

    @cached_property
    def on_noise(self) -> tuple[str, ...]:
        """Names of the effects that take part on the noise."""
        return tuple(n for n in self.effects if n in self.noise or n == QUANTISATION)

    @cached_property
    def likeliest_kernel(self) -> str:
        """Kernel along which unknown structure is most probable."""
        by_name = self.subspaces.by_correlation
        return max(
            self.kernel_names, key=lambda name: np.logaddexp.reduce(by_name(name))
        )

    @property
    def likeliest_correlation(self) -> float:
        """The most probable AR(1) coefficient."""
        index = int(np.argmax(self.weight_of_correlations))
        return float(self.prepared.rows.correlations[index])

    @property
    def likely_correlations(self) -> np.ndarray:
        """Indices of the AR(1) coefficients that are not next to impossible."""
        return np.flatnonzero(self.weight_of_correlations >= _LEAST_WEIGHT)

    @cached_property
    def weight_of_correlations(self) -> np.ndarray:
        """Weight of each AR(1) coefficient, by the best hypothesis at each."""
        best = np.max(np.stack(list(self.table.values())), axis=0)
        weight = np.exp(best - np.max(best))
        return weight / weight.sum()


def with_remainder(effect: str) -> str:
    """Return the name of an effect with an unknown remainder beside it."""
    return f"{effect}+{UNKNOWN}"


def pair_name(one: str, other: str) -> str:
    """Return the name of a pair, its effects in alphabetical order."""
    return "+".join(sorted((one, other)))
