"""The force on gears, draw by draw: everything that designs take from the simulator."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Case
from hdcal.data.theory_names import Theory
from hdcal.inference.problem import Problem
from hdcal.inference.residuals import misfits
from hdcal.prediction.engine.causes import averaging_words, jointly_worth, likeliest
from hdcal.prediction.engine.gear_forces import MODULUS, gear_forces, gear_values
from hdcal.prediction.engine.models import Models
from hdcal.prediction.engine.pooled import pool
from hdcal.prediction.engine.population import new_member_sd
from hdcal.prediction.engine.sizes import SIZES, matters, stiffness_ratio
from hdcal.prediction.engine.untested import Untested

__all__ = ["MODULUS", "SIZES", "CalibratedGear", "Models", "matters", "stiffness_ratio"]


@dataclass(frozen=True)
class CalibratedGear:
    """Draws of a calibrated gear without the rig: neither zeros nor drift of gauges.

    Attributes:
        case: data and gear.
        theory: which stiffness K multiplies.
        values: draws by site, in code units: [draw, …].
        independent: effective number of draws.
        notes: unresolved causes and misfits, in sentences.
        problem: structure of the model.
        untested: uncertainty beyond the tested conditions.
    """

    case: Case
    theory: Theory
    values: Mapping[str, np.ndarray]
    independent: float
    notes: tuple[str, ...]
    problem: Problem
    untested: Untested

    @classmethod
    def of(cls, models: Models, seed: int) -> "CalibratedGear":
        """Return the draws of one or several weighted models.

        Raises:
            NotUsable: a calibration failed its checks.
            InputError: they are no models of the same data.
        """
        pooled = pool(models)
        values, untested = gear_values(pooled, seed)
        misfit = misfits(likeliest(pooled.causes).posterior)
        return cls(
            case=pooled.case,
            theory=pooled.theory,
            values={name: np.asarray(draws) for name, draws in values.items()},
            independent=min(jointly_worth(pooled.causes), len(values["K"])),
            notes=(*averaging_words(pooled.causes), *misfit),
            problem=pooled.problem,
            untested=untested,
        )

    def forces(self, values, deformation, temperature, factor) -> np.ndarray:
        """Return the force of every draw [N], (n, draw); each row is loaded from rest.

        Args:
            values: draws, of which those of the modulus may be another material's.
            deformation: radial, from the free shape, of either sign [mm], shape (n,).
            temperature: of the gear [°C], shape (n,).
            factor: stiffness over that of the tested gear [-], broadcast to (draw, n).
        """
        place = deformation, temperature, factor
        return np.asarray(gear_forces(self.problem, values, *place, self.untested))

    @property
    def effects(self) -> list[str]:
        """Names of the effects on the force."""
        return [e.name for e in self.problem.effects if e.stage == "force"]

    @property
    def specimens(self) -> int:
        """Number of tested gears between which the model has scatter."""
        return self.problem.specimens

    def specimen_sd(self) -> np.ndarray:
        """Return the relative sd of the next gear's stiffness of each draw."""
        return new_member_sd(np.asarray(self.values["specimen_sd"]), self.specimens)
