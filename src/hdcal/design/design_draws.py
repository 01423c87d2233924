"""Draws that a design is computed from: those of a posterior or of a prior.

K is carried over: a gear of other sizes is taken to have the K of the tested one, so
that its stiffness is that of the tested gear times a ratio of two formulas.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from hdcal.data.case import Gear
from hdcal.data.plausible import implausible
from hdcal.data.prior import scaled
from hdcal.data.priors import (
    Prior,
    material_names,
    material_priors,
)
from hdcal.data.records import Geometry, Records
from hdcal.data.theory_names import SPRING, Theory
from hdcal.design.materials import material_of
from hdcal.errors import Finding, Findings
from hdcal.inference.distributions import frozen, sample_prior
from hdcal.inference.problem import Problem
from hdcal.inference.residuals import misfits
from hdcal.inference.values import Values
from hdcal.physics.chain import Reading
from hdcal.physics.theory import THEORIES
from hdcal.prediction.engine.causes import (
    averaging_words,
    jointly_worth,
    likeliest,
)
from hdcal.prediction.engine.gear_forces import MODULUS, gear_forces, gear_values
from hdcal.prediction.engine.models import Models
from hdcal.prediction.engine.pooled import Pooled, pool
from hdcal.prediction.engine.sizes import SIZES
from hdcal.prediction.engine.untested import Untested


@dataclass(frozen=True)
class DesignDraws:
    """Draws that designs are computed from.

    Attributes:
        gear: sizes and material that the draws belong to.
        theory: which stiffness K multiplies.
        problem: structure.
        values: draws by site, in code units: [draw, …].
        facts: priors and facts of the material in use, as in its file.
        material: its name.
        kind: whether the draws are a posterior's or a prior's.
        records: the tested rows, or None.
        misfits: warnings of causes that are not settled and of shapes in the residuals.
        untested: additional uncertainty beyond the tested conditions, for each cause;
            None where no gear was tested.
        effective_size: of the sample; None where the draws are independent.
    """

    gear: Gear
    theory: Theory
    problem: Problem
    values: Values
    facts: dict[str, Prior]
    material: str
    kind: Literal["posterior", "prior"]
    records: Records | None
    misfits: tuple[str, ...] = ()
    untested: Untested | None = None
    effective_size: float | None = None

    @property
    def size(self) -> int:
        """Number of draws."""
        return len(self.values["K"])

    @property
    def independent(self) -> float:
        """Effective sample size, at most the number of draws."""
        effective = self.effective_size
        return self.size if effective is None else min(effective, self.size)

    @property
    def nominal_deformation(self) -> float | None:
        """Design deformation of the gear itself, radial [mm]; the file's is as read."""
        read = self.gear.nominal_deformation
        return None if read is None else read * self.problem.reading.radial_per_read

    def size_of(self, name: str) -> float:
        """Return a size of the tested gear [mm], such as that of `radius_mm`."""
        return float(getattr(self.gear.geometry, SIZES[name]))

    @property
    def interval_kind(self) -> str:
        """What an interval from these draws is called."""
        known = {"posterior": "credible", "prior": "prior"}[self.kind]
        return f"equal-tailed {known} interval"

    @property
    def drawing(self) -> Geometry:
        """The gear's sizes [mm], with Poisson's ratio of the material in use."""
        geometry = self.gear.geometry
        if self.material == self.gear.material or "poisson" not in self.facts:
            return geometry
        return replace(geometry, poisson=float(self.facts["poisson"].numbers[0]))

    @cached_property
    def yield_strength(self) -> np.ndarray | None:
        """Draws of the yield strength [MPa], or None where the material has none."""
        prior = self.facts.get("yield_strength")
        if prior is None:
            return None
        if prior.family == "fixed":
            return np.full(self.size, float(prior.numbers[0]))
        # Evenly over its distribution, in an independent order.
        places = (np.arange(self.size) + 0.5) / self.size
        shuffled = np.random.default_rng(self.size).permutation(places)
        return np.asarray(frozen(prior).ppf(shuffled))

    def usual_force(self, deformation: float) -> float:
        """Return the approximate force [N] at a radial deformation [mm]."""
        stiffness = self.values["K"] * self.values["E0"] * self.problem.unit_stiffness
        return abs(float(np.median(stiffness)) * deformation)

    def within_tested(self, deformation: np.ndarray) -> np.ndarray:
        """Tell which deformations lie between zero and the ends of the tested range.

        Args:
            deformation: radial, of the gear [mm].
        """
        if self.records is None:
            return np.ones(np.shape(deformation), dtype=bool)
        read = np.asarray(deformation) / self.problem.reading.radial_per_read
        zero, tested = self.values["deformation_offset"], self.records.deformation
        low, high = min(0.0, np.min(tested)), max(0.0, np.max(tested))
        return (read + np.min(zero) >= low) & (read + np.max(zero) <= high)

    def bend_sd(self, deformation: float) -> float:
        """Return the sd of the force that untested deformation may add [N]."""
        place = np.array([deformation]), np.array([self.gear.reference_temperature])
        whole, straight = (
            np.asarray(gear_forces(self.problem, self.values, *place, 1.0, untested))
            for untested in (self.untested, None)
        )
        return float(np.std(whole - straight))

    def of_material(self, name: str, seed: int = 0) -> "DesignDraws":
        """Return the draws of the same gear made of another material.

        Args:
            name: a shipped material, or the path of a .toml file of one.
            seed: of the draws of its modulus.

        Raises:
            InputError: there is no such material.
        """
        if name == self.material:
            return self
        facts = material_of(name)
        # Independent of the draws of the gear as it is.
        rng = np.random.default_rng([seed, 1])
        new = {
            site: sample_prior(facts[site], site, rng, self.size)
            for site in ("E0", "alpha")
        }
        stiffer = new["E0"] / np.asarray(self.values["E0"])
        values = {**self.values, **new, MODULUS: stiffer}
        return replace(self, values=values, facts=facts, material=name)


def design_draws(
    source: Models | Gear, *, draws: int = 4000, seed: int = 0
) -> DesignDraws:
    """Return the draws that designs are computed from.

    Args:
        source: a calibration, or a gear with priors only.
        draws: number of them from priors; a calibration brings its own.
        seed: of those draws.

    Raises:
        NotUsable: the calibration failed its checks.
        InputError: the seed is invalid, or the theory has no sizes.
    """
    known = source if isinstance(source, Gear) else pool(source)
    with Findings() as wrong:
        wrong += implausible("seed", seed)
        if known.theory == SPRING:
            words = "has no sizes, and a design changes sizes"
            remedy = "Calibrate with the sizes of the gear and another theory"
            wrong.append(Finding(f"theory '{SPRING}'", words, remedy))
    if isinstance(known, Pooled):
        return _calibrated(known, seed)
    ratio = _formula(known, known.K_theory) / _formula(known, known.theory)
    priors = {**known.priors, "K": scaled(known.priors["K"], ratio)}
    rng = np.random.default_rng(seed)
    values = {
        name: sample_prior(prior, name, rng, draws) for name, prior in priors.items()
    }
    return DesignDraws(
        gear=known,
        theory=known.theory,
        problem=_bare_problem(known),
        values=values,
        facts=_material_facts(known),
        material=known.material,
        kind="prior",
        records=None,
    )


def _calibrated(pooled: Pooled, seed: int) -> DesignDraws:
    causes, gear = pooled.causes, pooled.case.gear
    values, untested = gear_values(pooled, seed)
    main = likeliest(causes).posterior
    return DesignDraws(
        gear=gear,
        theory=pooled.theory,
        problem=pooled.problem,
        values=values,
        facts=_material_facts(gear),
        material=gear.material,
        kind="posterior",
        records=pooled.case.records,
        misfits=(*averaging_words(causes), *misfits(main)),
        untested=untested,
        effective_size=jointly_worth(causes),
    )


def _material_facts(gear: Gear) -> dict[str, Prior]:
    # The material file of a user may have moved since; only its yield strength would
    # be used.
    shipped = gear.material in material_names()
    return material_priors(gear.material) if shipped else {}


def _formula(gear: Gear, theory: Theory) -> float:
    return float(THEORIES[theory](gear.geometry, 1.0))


def _bare_problem(gear: Gear) -> Problem:
    """Return the structure of a force model without data."""
    half = gear.reading == "diametral"
    return Problem(
        priors={},
        units={},
        unit_stiffness=_formula(gear, gear.theory),
        reading=Reading(0.5 if half else 1.0, gear.reference_temperature),
        records=None,
        blocks=None,
        columns=None,
        discrepancy=None,
        step=0.0,
        effects=(),
        rounded=False,
        runs=0,
        specimens=0,
        integrated=(),
    )
