"""Effects that these records cannot tell apart, untestable ones among them."""

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from hdcal.diagnosis.verdict import NotTestable
from hdcal.evidence.case_evidence import LEAST_SEEN, CaseEvidence
from hdcal.evidence.hypothesis_design import fitted_curve
from hdcal.evidence.linear_rows import remove_base
from hdcal.evidence.piecewise_effect import piecewise_effect
from hdcal.evidence.subspaces import is_subspace
from hdcal.physics.effect import Effect

# Squared correlation, beside the base model, from which two shapes look alike.
ALIKE = 0.8


def untestable_lookalikes(
    evidence: CaseEvidence, effect: str, library: Mapping[str, type[Effect]]
) -> tuple[NotTestable, ...]:
    """Return effects that would bend the readings as the leading one does.

    What sets them apart needs another loading, so that no evidence excludes them: a
    wall that yields is a sensor that saturates until it is unloaded.

    Args:
        evidence: of the case.
        effect: that leads.
        library: effects by name.
    """
    if effect not in evidence.single.names:
        return ()
    prepared = evidence.prepared
    rows, noise = prepared.rows, prepared.noise_sd
    (curve,) = remove_base(rows, fitted_curve(evidence, effect)[None]) * rows.weight
    size = float(curve @ curve)
    found = []
    for name, needs in evidence.not_testable.items():
        if library[name].stage == "noise" or is_subspace(library[name], prepared):
            continue
        other = piecewise_effect(library[name], prepared)
        left = remove_base(rows, other.large) * rows.weight
        squares = np.sum(left**2, axis=1)
        # What leaves nothing beside the base, such as a drift without temperatures.
        seen = squares > LEAST_SEEN * noise**2
        if not seen.any():
            continue
        along = left[seen] @ curve
        if other.grid.one_sided:
            # It bends one way only.
            along = np.maximum(along, 0.0)
        alike = float(np.max(along**2 / (squares[seen] * size)))
        if alike > ALIKE and (1.0 - alike) * size < LEAST_SEEN * noise**2:
            found.append(NotTestable(name, needs))
    return tuple(found)


def inseparable(evidence: CaseEvidence) -> tuple[tuple[str, str], ...]:
    """Return pairs of effects that this loading can never tell apart.

    In the best case most of the smaller one is shared by the other, and what is not
    has less than `LEAST_SEEN` squared noise sds.
    """
    rows, noise = evidence.prepared.rows, evidence.prepared.noise_sd
    left = {
        each.name: remove_base(rows, each.large) * rows.weight
        for each in evidence.piecewise
        if each.name in evidence.table
    }
    sided = {each.name for each in evidence.piecewise if each.grid.one_sided}
    pairs = []
    for one, two in combinations(left, 2):
        a, b = left[one], left[two]
        along = a @ b.T
        if {one, two} <= sided:
            # Both bend one way only.
            along = np.maximum(along, 0.0)
        size_a, size_b = np.sum(a**2, axis=1), np.sum(b**2, axis=1)
        share = along**2 / np.maximum(size_a[:, None] * size_b, 1e-300)
        apart = np.minimum(size_a[:, None], size_b) * (1.0 - share)
        alike = np.min(share) > ALIKE
        if alike and np.max(apart) < LEAST_SEEN * noise**2:
            pairs.append((one, two))
    return tuple(pairs)
