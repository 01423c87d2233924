"""The evidences of one case and what they were computed from."""

from dataclasses import dataclass, field

import numpy as np

from hdcal.evidence.noise_evidence import NoiseEvidence
from hdcal.evidence.piecewise_effect import PiecewiseEffect
from hdcal.evidence.prepare import PreparedCase
from hdcal.evidence.single_evidence import SingleEvidence
from hdcal.evidence.subspaces import SubspaceEvidence
from hdcal.inference.hypotheses import NONE as NONE
from hdcal.inference.hypotheses import UNKNOWN as UNKNOWN

QUANTISATION = "quantisation"
# Squared length in noise sds below which an effect of large physical size is unseen.
LEAST_SEEN = 6.0


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

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that take part."""
        return tuple(n for n in self.table if n not in (NONE, UNKNOWN) and "+" not in n)


def pair_name(one: str, other: str) -> str:
    """Return the name of a pair, its effects in alphabetical order."""
    return "+".join(sorted((one, other)))
