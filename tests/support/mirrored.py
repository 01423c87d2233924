"""What is seen of a gear that is pulled where another one was pressed."""

from dataclasses import replace
from typing import Any

import numpy as np
from posteriors import written_posterior

from hdcal.data.case import Case
from hdcal.inference.posterior import Posterior

# Columns and draws that change their sign with the loading. Parameters of effects are
# those of effects whose contribution does not change it.
_COLUMNS = ("deformation", "force", "direction", "sense", "rate")
_DRAWS = ("force_offset", "deformation_offset", "run_offset")
_DRAWS += ("thermal_zero_drift.slope", "displacement_nonlinearity.curvature")


def mirrored_case(case: Case) -> Case:
    """Return the case with the sign of deformation and force turned."""
    columns = {name: -getattr(case.records, name) for name in _COLUMNS}
    return replace(case, records=replace(case.records, **columns))


def mirrored_draws(draws: dict[str, Any]) -> dict[str, Any]:
    """Return the draws of the same gear calibrated from the mirrored readings."""
    found = dict(draws)
    for name in found.keys() & {*_DRAWS}:
        found[name] = -found[name]
    if "gap_weights" in found:
        # The eigenfunctions are even and odd by turns about the middle of the range.
        parity = (-1.0) ** np.arange(np.shape(found["gap_weights"])[-1])
        found["gap_weights"] = -parity * found["gap_weights"]
    return found


def mirrored(posterior: Posterior) -> Posterior:
    """Return the posterior of the mirrored readings, draw by draw."""
    return written_posterior(
        mirrored_case(posterior.case),
        mirrored_draws(dict(posterior.draws)),
        effects=[effect.name for effect in posterior.effects],
        with_gap=posterior.problem.discrepancy is not None,
    )
