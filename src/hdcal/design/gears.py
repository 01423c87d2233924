"""The gears that a design has to fit: one for each draw, with its sizes.

K is carried over: a gear of other sizes is taken to have the K of the tested one, so
that its stiffness is that of the tested gear times a ratio of two formulas.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hdcal.data.case import Gear
from hdcal.data.plausible import implausible
from hdcal.data.priors import material_names, material_priors
from hdcal.data.records import Geometry
from hdcal.data.theory_names import SPRING, Theory
from hdcal.errors import Finding, InputError
from hdcal.inference.distributions import sample_prior
from hdcal.inference.force_model.residuals import noise_warnings
from hdcal.physics.theory import peak_stress
from hdcal.prediction.conditions import Conditions
from hdcal.prediction.joint import JointModel, joint
from hdcal.prediction.models import Models, averaging_words
from hdcal.prediction.simulate import gear_forces
from hdcal.prediction.sizes import SIZES, stiffness_ratio

Sizes = Mapping[str, Any]


@dataclass(frozen=True)
class Gears:
    """Gears, one for each draw; deformations and forces are along the loading.

    A gear that is pulled is the mirror of one that is pressed: the sense, ±1, gives
    numbers their sign outside. Shifts are of sizes from the drawing [mm], by name,
    (draw,), the deviation is of the stiffness from the tested mean, relative, (draw,).
    """

    model: JointModel
    seed: int = 0
    notes: tuple[str, ...] = ()
    sense: int = 1
    shifts: dict[str, np.ndarray] = field(default_factory=dict)
    deviation: np.ndarray | float = 0.0

    @property
    def independent(self) -> float:
        """Effective number of draws."""
        return self.model.independent_draws

    @property
    def gear(self) -> Gear:
        """Sizes and material of the tested gear."""
        return self.model.posterior.case.gear

    @property
    def theory(self) -> Theory:
        """Theory of the stiffness."""
        return self.model.posterior.theory

    @property
    def radial_per_read(self) -> float:
        """Radial deformation per deformation as read [-]."""
        return self.model.problem.reading.radial_per_read

    @property
    def scatters(self) -> bool:
        """Whether the gears differ from each other."""
        return bool(self.shifts) or bool(np.any(self.deviation))

    def size_of(self, name: str) -> float:
        """Return a size of the tested gear [mm], such as that of `radius_mm`."""
        return float(getattr(self.gear.geometry, SIZES[name]))

    def made(self, sizes: Sizes) -> Geometry:
        """Return the gears as made: sizes [mm] and each gear's deviations from them."""
        nominal = {name: self.size_of(name) for name in self.shifts} | {**sizes}
        shifted = {n: nominal[n] + self.shifts.get(n, 0.0) for n in nominal}
        changed = {SIZES[name]: value for name, value in shifted.items()}
        return replace(self.gear.geometry, **changed)

    def factor(self, sizes: Sizes) -> np.ndarray:
        """Return the stiffness over that of the tested gear [-] for `forces`."""
        ratio = stiffness_ratio(self.made(sizes), self.gear.geometry, self.theory)
        factor = np.asarray(ratio * (1.0 + self.deviation))
        return factor[:, None] if self.scatters else factor

    def forces(self, deformation: Any, temperature: Any, factor: Any = 1.0):
        """Return the force on each gear, loaded from its free shape [N], (n, draw).

        Deformations [mm] and temperatures [°C] are (n,); the stiffness over that of the
        tested gear is broadcast to (draw, n).
        """
        place = self.sense * np.asarray(deformation) / self.radial_per_read
        at = Conditions.of(
            place,
            np.asarray(temperature),
            np.where(place < 0.0, -1.0, 1.0),
            quantity="gear",
            factor=np.broadcast_to(factor, (self.model.size, len(place))),
        )
        return self.sense * gear_forces(self.model, at, seed=self.seed).T

    def stresses(self, sizes: Sizes, deformation: float, temperature: Any):
        """Return the largest hoop bending stress over temperatures [MPa], (draw,)."""
        rise = np.asarray(temperature) - self.gear.reference_temperature
        warm = np.max(1.0 - self.model.draws["alpha"][:, None] * rise, axis=1)
        modulus = self.model.draws["E0"] * warm
        return np.asarray(peak_stress(self.made(sizes), modulus, deformation))

    def strengths(self) -> np.ndarray | None:
        """Draw the yield strength [MPa]; None where the material has none."""
        # The material file of a user may have moved since the calibration.
        name, size = self.gear.material, self.model.size
        facts = material_priors(name) if name in material_names() else {}
        prior, rng = facts.get("yield_strength"), np.random.default_rng(size)
        return prior and sample_prior(prior, "yield_strength", rng, size)

    def next_ones(self, tolerances: Mapping, seed: int, sense: int) -> "Gears":
        """Draw the gears that a design has to fit, from ± of sizes [mm] by name."""
        rng, deviation, size = np.random.default_rng(seed), 0.0, self.model.size
        shifts = {n: rng.uniform(-w, w, size) for n, w in tolerances.items()}
        if tested := self.model.problem.specimens:
            # A new gear also has the distance of the tested mean from the population's.
            sd = self.model.draws["specimen_sd"] * (1.0 + 1.0 / tested) ** 0.5
            deviation = sd * rng.normal(size=size)
        return replace(self, shifts=shifts, deviation=deviation, sense=sense)


def calibrated_gears(models: Models, seed: int = 0) -> Gears:
    """Return the tested gear, in every draw; refuse failed checks and springs."""
    if wrong := implausible("seed", seed):
        raise InputError(wrong)
    model = joint(models)
    if model.posterior.theory == SPRING:
        words = "has no sizes, which a design needs"
        remedy = (
            "Calibrate with the sizes of the gear in a gear file and another theory"
        )
        raise InputError([Finding(f"theory '{SPRING}'", words, remedy)])
    notes = *averaging_words(models), *noise_warnings(model.posterior)
    return Gears(model, seed, notes)
