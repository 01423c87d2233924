"""The force on gears, draw by draw: everything that designs take from the simulator."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Case
from hdcal.data.theory_names import Theory
from hdcal.inference.residuals import noise_warnings
from hdcal.prediction.conditions import Conditions
from hdcal.prediction.joint import JointModel, joint
from hdcal.prediction.models import Models, averaging_words
from hdcal.prediction.simulate import gear_forces
from hdcal.prediction.sizes import SIZES, matters, stiffness_ratio

__all__ = ["MODULUS", "SIZES", "GearModel", "Models", "matters", "stiffness_ratio"]
# Site of a draw: its modulus over that of the tested gear, in another material.
MODULUS = "_modulus"


@dataclass(frozen=True)
class GearModel:
    """Draws of a calibrated gear without the rig: neither zeros nor drift of gauges.

    Attributes:
        model: all models as one.
        seed: of what the draws leave open.
        notes: unresolved causes and faults of the noise, in sentences.
    """

    model: JointModel
    seed: int
    notes: tuple[str, ...]

    @classmethod
    def of(cls, models: Models, seed: int) -> "GearModel":
        """Return the draws of one or several weighted models.

        Raises:
            NotUsable: a calibration failed its checks.
            InputError: they are no models of the same data.
        """
        whole = joint(models)
        notes = (*averaging_words(models), *noise_warnings(whole.posterior))
        return cls(whole, seed, notes)

    @property
    def case(self) -> Case:
        """Data and gear."""
        return self.model.posterior.case

    @property
    def theory(self) -> Theory:
        """Theory whose stiffness K multiplies."""
        return self.model.posterior.theory

    @property
    def values(self) -> dict[str, np.ndarray]:
        """Draws by site, in code units: [draw, …]."""
        return self.model.draws

    @property
    def independent(self) -> float:
        """Effective number of draws."""
        return self.model.independent_draws

    def forces(
        self, values: Mapping[str, np.ndarray], deformation, temperature, factor
    ) -> np.ndarray:
        """Return the force of every draw [N], (n, draw); each row is loaded from rest.

        Args:
            values: draws, of which those of the modulus may be another material's.
            deformation: radial, from the free shape, of either sign [mm], shape (n,).
            temperature: of the gear [°C], shape (n,).
            factor: stiffness over that of the tested gear [-], broadcast to (draw, n).
        """
        place = np.asarray(deformation) / self.model.problem.reading.radial_per_read
        modulus = np.reshape(values.get(MODULUS, 1.0), (-1, 1))
        at = Conditions.of(
            place,
            temperature,
            np.where(place < 0.0, -1.0, 1.0),
            quantity="gear",
            factor=factor * modulus,
        )
        # Another modulus is in the factor; its loss with temperature is not.
        draws = self.model.draws | {"alpha": values["alpha"]}
        return gear_forces(self.model, at, draws, seed=self.seed).T

    @property
    def effects(self) -> list[str]:
        """Names of the effects on the force."""
        return [e.name for e in self.model.effects if e.stage == "force"]

    @property
    def specimens(self) -> int:
        """Number of tested gears between which the model has scatter."""
        return self.model.problem.specimens

    def specimen_sd(self) -> np.ndarray:
        """Return the relative sd of the next gear's stiffness of each draw.

        A new gear also has the distance of the tested mean from the population's.
        """
        return self.values["specimen_sd"] * (1.0 + 1.0 / self.specimens) ** 0.5
