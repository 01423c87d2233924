"""The evidences of one case, and each effect at its most probable point."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hdcal.evidence.design_matrix import (
    Design,
    fit_design,
    join_designs,
    line_design,
    subspace_design,
)
from hdcal.evidence.effect_lines import Lines
from hdcal.evidence.noise_evidence import NoiseEvidence
from hdcal.evidence.prepare import Setting
from hdcal.evidence.single_evidence import Singles
from hdcal.evidence.subspaces import Subspaces

QUANTISATION = "quantisation"
UNKNOWN = "unknown"
NONE = "none"
# Squared length in noise sds below which an effect of large physical size is unseen.
LEAST_SEEN = 6.0


@dataclass(frozen=True)
class Assessment:
    """Log evidences and what they were computed from.

    Attributes:
        setting: the case, laid out.
        lines: of the effects that are one line.
        singles: their evidences.
        subspaces: effects with several columns, then kernels of unknown structure.
        wide: effects with several columns.
        kernel_names: of the unknown structure.
        noise: effects on the noise.
        step: of the grid of readings [N], 0 = none.
        table: log evidence of each hypothesis by name, [correlation].
        not_testable: effect → features that the records lack.
        not_excited: effects that this program cannot show at a physical size.
        accounted: effects that the gear file already accounts for.
        scatter: those of `wide` that are the members' of a label.
    """

    setting: Setting
    lines: tuple[Lines, ...]
    singles: Singles
    subspaces: Subspaces
    wide: tuple[str, ...]
    kernel_names: tuple[str, ...]
    noise: dict[str, NoiseEvidence]
    step: float
    table: dict[str, np.ndarray]
    not_testable: dict[str, tuple[str, ...]]
    not_excited: tuple[str, ...]
    accounted: tuple[str, ...]
    scatter: tuple[str, ...]

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that take part."""
        return tuple(n for n in self.table if n not in (NONE, UNKNOWN) and "+" not in n)


def pair_name(one: str, other: str) -> str:
    """Return the name of a pair, its effects in alphabetical order."""
    return "+".join(sorted((one, other)))


def design_of(found: Assessment, names: Sequence[str]) -> Design:
    """Return what effects add at their most probable point; noise adds nothing."""
    parts = []
    for name in names:
        if name in found.singles.names:
            index = found.singles.names.index(name)
            parts.append(line_design(found.singles, found.lines[index], index))
        elif name in found.subspaces.names:
            parts.append(subspace_design(found.subspaces, name))
    return join_designs(parts, len(found.setting.rows.reading))


def expansion_beside(found: Assessment, names: Sequence[str]) -> tuple[float, float]:
    """Return the stiffness [N/mm] and noise sd [N] that are fitted beside effects."""
    setting, rows = found.setting, found.setting.rows
    design = design_of(found, names)
    fit = fit_design(rows, design, setting.noise_sd, 0.0)
    # The first coefficient is the deviation of log stiffness about least squares.
    shift = setting.log_stiffness - np.log(setting.base.stiffness)
    change = shift + setting.log_stiffness_sd * fit.mean[0]
    left = (np.asarray(rows.reading) - fit.predict()) * np.asarray(rows.weight)
    freedom = max(len(left) - 3 - len(design.columns), 1)
    return (
        float(setting.base.stiffness * (1.0 + change)),
        float(np.sqrt(np.sum(left**2) / freedom)),
    )


def curve_of(found: Assessment, name: str) -> np.ndarray:
    """Return what one effect adds at its best fit [N], shape (n,)."""
    rows = found.setting.rows
    fit = fit_design(rows, design_of(found, [name]), found.setting.noise_sd, 0.0)
    return fit.contribution(rows.base.shape[1])
