"""A rig without effects: its true parameters, its noise, what its base absorbs."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from hdcal.data.case import Case, Gear
from hdcal.data.priors import material_priors, rig_priors
from hdcal.data.records import Geometry, Records
from hdcal.physics.chain import Base, Reading, predict_reading

READING = Reading(1.0, 20.0)
# True spread of the loss of modulus per kelvin; the gear's prior states the same.
_ALPHA, _ALPHA_SD = 3e-4, 4e-5
_BASE = ("K", "E0", "alpha", "force_offset", "deformation_offset", "sigma")
_SCALES = ("run_offset_sd", "specimen_sd", "gap_sd", "gap_length")


@dataclass(frozen=True)
class World:
    """The truth but for what is missing from the force model.

    Attributes:
        records: the program.
        base: the force model.
    """

    records: Records
    base: Base

    @property
    def sigma(self) -> float:
        return float(self.base.sigma)

    @cached_property
    def plain(self) -> np.ndarray:
        """Mean readings without any effect [N]."""
        return np.asarray(predict_reading(self.base, (), self.records, READING)[0])

    @cached_property
    def left(self) -> np.ndarray:
        """What of a curve is left beside slope, zero and the loss of modulus: (n, n).

        The first two are free, the third as far as its prior lets it.
        """
        w = np.asarray(self.records.deformation)
        rise = np.asarray(self.records.temperature) - READING.reference_temperature
        warm = self.base.stiffness * _ALPHA_SD * w * rise / self.sigma
        columns = np.stack([w, np.ones_like(w), warm], axis=1)
        gram = columns.T @ columns + np.diag([0.0, 0.0, 1.0])
        return np.eye(len(w)) - columns @ np.linalg.solve(gram, columns.T)

    def size(self, curves: np.ndarray) -> np.ndarray:
        """Return r of curves (…, n): root mean square of what is left, over σ."""
        return np.sqrt(np.mean((curves @ self.left) ** 2, axis=-1)) / self.sigma

    def case(self, force: np.ndarray) -> Case:
        """Return the case of these readings."""
        run = np.asarray(self.records.run)
        return Case(
            name="made up",
            gear=_gear(),
            records=replace(self.records, force=force),
            run_labels=tuple(map(str, range(int(run.max()) + 1))),
            specimen_labels=("0",),
            data_sha256="0" * 64,
        )


def draw_world(records: Records, rng: np.random.Generator) -> World:
    """Draw true parameters for a program."""
    stiffness, sigma = rng.uniform(150.0, 260.0), rng.uniform(0.3, 0.9)
    alpha = rng.normal(_ALPHA, _ALPHA_SD)
    base = Base(stiffness, alpha, rng.normal(0.0, 0.005), rng.normal(), sigma)
    return World(records, base)


def draw_noise(
    world: World, rng: np.random.Generator, correlation: float = 0.0, tails: int = 0
) -> np.ndarray:
    """Return noise of standard deviation σ [N].

    Args:
        world: for the rows and σ.
        rng: source of randomness.
        correlation: AR(1) coefficient within a run.
        tails: degrees of freedom of Student's t; 0 is normal.
    """
    run = np.asarray(world.records.run)
    new = rng.normal(size=len(run))
    if tails:
        new = rng.standard_t(tails, size=len(run)) / np.sqrt(tails / (tails - 2.0))
    noise = new.copy()
    for i in range(1, len(run)):
        if run[i] == run[i - 1]:
            fresh = np.sqrt(1.0 - correlation**2) * new[i]
            noise[i] = correlation * noise[i - 1] + fresh
    return world.sigma * noise


def _gear() -> Gear:
    table = rig_priors() | material_priors("40CrNiMoA")
    return Gear(
        name="made up",
        geometry=Geometry(0.68, 40.0, 70.0, 62.0, 0.29),
        material="40CrNiMoA",
        theory="ring",
        reading="radial",
        reference_temperature=READING.reference_temperature,
        force_resolution=0.0,
        nominal_deformation=0.4,
        priors={name: table[name] for name in _BASE},
        scale_priors={name: table[name] for name in _SCALES},
    )
