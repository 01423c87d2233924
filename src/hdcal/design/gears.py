"""The gears that a design has to fit: one for each draw, with its sizes and material.

K is carried over: a gear of other sizes is taken to have the K of the tested one, so
that its stiffness is that of the tested gear times a ratio of two formulas.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from hdcal.data.case import Gear
from hdcal.data.plausible import implausible
from hdcal.data.priors import Prior, material_names, material_priors, read_material
from hdcal.data.records import Geometry
from hdcal.data.theory_names import SPRING, Theory
from hdcal.errors import Finding, InputError
from hdcal.inference.distributions import sample_prior
from hdcal.inference.force_model.residuals import noise_warnings
from hdcal.physics.theory import THEORIES, peak_stress
from hdcal.prediction.conditions import Conditions
from hdcal.prediction.joint import JointModel, joint
from hdcal.prediction.models import Models, averaging_words
from hdcal.prediction.simulate import gear_forces
from hdcal.prediction.sizes import SIZES, stiffness_ratio

Sizes = Mapping[str, Any]
# Site of a draw: its modulus over that of the tested gear, in another material.
MODULUS = "_modulus"


@dataclass(frozen=True)
class Gears:
    """Gears, one for each draw; deformations and forces are along the loading.

    A gear that is pulled is the mirror of one that is pressed: the sense gives numbers
    their sign outside.

    Attributes:
        gear: sizes and material of the tested gear.
        facts: priors and facts of the material in use.
        values: draws by site, in code units: [draw, …].
        independent: effective number of draws.
        model: of the tested gear, all models as one; None where only priors are known.
        seed: of what the draws leave open.
        notes: unresolved causes and faults of the noise, in sentences.
        sense: +1 for gears that are pressed, −1 for gears that are pulled.
        shifts: of sizes from the drawing [mm], by name, (draw,).
        deviation: of the stiffness from the tested mean, relative, (draw,).
    """

    gear: Gear
    theory: Theory
    material: str
    facts: dict[str, Prior]
    values: Mapping[str, np.ndarray]
    independent: float
    model: JointModel | None = None
    seed: int = 0
    notes: tuple[str, ...] = ()
    sense: int = 1
    shifts: dict[str, np.ndarray] = field(default_factory=dict)
    deviation: np.ndarray | float = 0.0

    @property
    def size(self) -> int:
        """Number of draws."""
        return len(self.values["K"])

    @property
    def radial_per_read(self) -> float:
        """Radial deformation per deformation as read [-]."""
        return 0.5 if self.gear.reading == "diametral" else 1.0

    def size_of(self, name: str) -> float:
        """Return a size of the tested gear [mm], such as that of `radius_mm`."""
        return float(getattr(self.gear.geometry, SIZES[name]))

    def drawing(self, sizes: Sizes) -> Geometry:
        """Return the gear with some of its sizes [mm], made of the material in use."""
        changed = {SIZES[name]: value for name, value in sizes.items()}
        if self.material != self.gear.material and "poisson" in self.facts:
            changed["poisson"] = float(self.facts["poisson"].numbers[0])
        return replace(self.gear.geometry, **changed)

    def made(self, sizes: Sizes) -> Geometry:
        """Return the gears as made: the drawing and each one's deviations from it."""
        nominal = {name: self.size_of(name) for name in self.shifts} | {**sizes}
        shifted = {n: nominal[n] + by for n, by in self.shifts.items()}
        return self.drawing({**sizes, **shifted})

    @property
    def scatters(self) -> bool:
        """Whether the gears differ from each other."""
        return bool(self.shifts) or bool(np.any(self.deviation))

    def factor(self, sizes: Sizes) -> np.ndarray:
        """Return the stiffness over that of the tested gear [-] for `forces`."""
        ratio = stiffness_ratio(self.made(sizes), self.gear.geometry, self.theory)
        factor = np.asarray(ratio * (1.0 + self.deviation))
        return factor[:, None] if self.scatters else factor

    def forces(self, deformation: Any, temperature: Any, factor: Any = 1.0):
        """Return the force on each gear [N], shape (n, draw).

        Deformations [mm] and temperatures [°C] have the shape (n,); the stiffness over
        that of the tested gear is broadcast to (draw, n).
        """
        at, warm = self.sense * np.asarray(deformation), np.asarray(temperature)
        factor, values = np.broadcast_to(factor, (self.size, len(at))), self.values
        if self.model is not None:
            return self.sense * self._model_forces(self.model, at, warm, factor)
        unit = float(THEORIES[self.gear.K_theory](self.gear.geometry, 1.0))
        loss = values["alpha"] * (warm[:, None] - self.gear.reference_temperature)
        stiffness = values["K"] * values["E0"] * unit * (1.0 - loss) * factor.T
        return self.sense * stiffness * at[:, None]

    def _model_forces(self, model: JointModel, deformation, temperature, factor):
        """Return the force by the model [N], (n, draw), loaded from the free shape.

        Neither zeros nor drift of gauges belong to it.
        """
        place = deformation / model.problem.reading.radial_per_read
        at = Conditions.of(
            place,
            temperature,
            np.where(place < 0.0, -1.0, 1.0),
            quantity="gear",
            factor=factor * np.reshape(self.values.get(MODULUS, 1.0), (-1, 1)),
        )
        # Another modulus is in the factor; its loss with temperature is not.
        draws = model.draws | {"alpha": self.values["alpha"]}
        return gear_forces(model, at, draws, seed=self.seed).T

    def stresses(self, sizes: Sizes, deformation: float, temperature: Any):
        """Return the largest hoop bending stress over temperatures [MPa], (draw,)."""
        rise = np.asarray(temperature) - self.gear.reference_temperature
        warm = np.max(1.0 - self.values["alpha"][:, None] * rise, axis=1)
        made, modulus = self.made(sizes), self.values["E0"] * warm
        return np.asarray(peak_stress(made, modulus, deformation))

    def strengths(self) -> np.ndarray | None:
        """Draw the yield strength [MPa]; None where the material has none."""
        prior, rng = self.facts.get("yield_strength"), np.random.default_rng(self.size)
        return prior and sample_prior(prior, "yield_strength", rng, self.size)

    def next_ones(self, tolerances: Mapping, seed: int, sense: int) -> "Gears":
        """Draw the gears that a design has to fit, from ± of sizes [mm] by name.

        Sizes are uniform within known limits (JCGM 100:2008, 4.3.7).
        """
        rng, deviation = np.random.default_rng(seed), 0.0
        shifts = {n: rng.uniform(-w, w, self.size) for n, w in tolerances.items()}
        if self.model is not None and (tested := self.model.problem.specimens):
            # A new gear also has the distance of the tested mean from the population's.
            sd = self.values["specimen_sd"] * (1.0 + 1.0 / tested) ** 0.5
            deviation = sd * rng.normal(size=self.size)
        return replace(self, shifts=shifts, deviation=deviation, sense=sense)

    def of_material(self, name: str, seed: int) -> "Gears":
        """Return the same gears made of a shipped material, or that of a .toml file.

        Raises:
            InputError: there is no such material.
        """
        if name == self.material:
            return self
        own = name.endswith(".toml")
        facts = read_material(Path(name), name) if own else material_priors(name)
        # Independent of the draws of the gear as it is.
        rng = np.random.default_rng([seed, 1])
        new = {n: sample_prior(facts[n], n, rng, self.size) for n in ("E0", "alpha")}
        values = {**self.values, **new, MODULUS: new["E0"] / self.values["E0"]}
        return replace(self, values=values, facts=facts, material=name)


def draw_gears(given: Models | Gear | Gears, seed: int = 0, count: int = 4000) -> Gears:
    """Return the tested gear, or so many gears of a file with priors only.

    Raises:
        NotUsable: the calibration failed its checks.
        InputError: the seed is invalid, or the theory has no sizes.
    """
    if isinstance(given, Gears):
        return given
    if wrong := implausible("seed", seed):
        raise InputError(wrong)
    if isinstance(given, Gear):
        gear, theory, model, notes = given, given.theory, None, ()
    else:
        model = joint(given)
        notes = (*averaging_words(given), *noise_warnings(model.posterior))
        gear, theory = model.posterior.case.gear, model.posterior.theory
    if theory == SPRING:
        words = "has no sizes, and a design changes sizes"
        remedy = "Calibrate with the sizes of the gear and another theory"
        raise InputError([Finding(f"theory '{SPRING}'", words, remedy)])
    # The material file of a user may have moved since; only its yield strength would
    # be used.
    shipped = gear.material in material_names()
    facts = material_priors(gear.material) if shipped else {}
    own = gear, theory, gear.material, facts
    if model is not None:
        known = model.draws, model.independent_draws, model
        return Gears(*own, *known, seed=seed, notes=notes)
    rng, priors = np.random.default_rng(seed), gear.priors.items()
    values = {name: sample_prior(prior, name, rng, count) for name, prior in priors}
    return Gears(*own, values, count)
