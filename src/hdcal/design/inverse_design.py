"""Inverse geometry: the sizes that keep a force limit, with the least change.

Of all sizes inside their bounds with

    F ≤ limit and stress ≤ strength, each with the required probability,

the ones nearest to the tested gear are chosen: least Σ (ln x/x₀)², since K was found
there. Solved by sequential quadratic programming on the logarithms of the sizes, with
exact derivatives of the model.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Gear
from hdcal.data.records import Geometry
from hdcal.design.candidate import Candidate, candidate, elasticities, solve
from hdcal.design.checks import (
    name_findings,
    no_deformation,
    place_findings,
    probability_findings,
    size_findings,
    unseen_findings,
)
from hdcal.design.design_draws import Basis, basis_of
from hdcal.design.force_limit import Target
from hdcal.design.next_gear import NextGear, next_gear
from hdcal.design.sentences import beyond_tested, far_from_tested
from hdcal.design.sizes import (
    SIZES,
    geometry_with,
    named,
    with_reference,
)
from hdcal.errors import Finding, InputError, attempt
from hdcal.inference.posterior import Posterior


@dataclass(frozen=True)
class InverseDesign:
    """The design that keeps the limits, and what it was chosen among.

    Attributes:
        basis: what the draws belong to.
        gear: whom the limits are for.
        bounds: of each free size [mm] by edge name.
        deformation: radial, of the gear [mm].
        temperatures: at which the limits hold [°C].
        limit_force: [N].
        limit_stress: [MPa], or None for the yield strength.
        required: probability with which each limit is kept.
        chosen: the nearest to the tested gear.
        candidates: one for each material.
        tested: the tested gear itself.
        target: what was kept, of the chosen material.
        elasticities: d ln F / d ln x of the kept force at the chosen design.
        warnings: what is extrapolated, in words.
    """

    basis: Basis
    gear: NextGear
    bounds: Mapping[str, tuple[float, float]]
    deformation: float
    temperatures: np.ndarray
    limit_force: float
    limit_stress: float | None
    required: float
    chosen: Candidate
    candidates: tuple[Candidate, ...]
    tested: Candidate
    target: Target
    elasticities: Mapping[str, float]
    warnings: tuple[str, ...]

    @property
    def drawing(self) -> Geometry:
        """The chosen gear's sizes [mm]."""
        return geometry_with(self.basis.gear.geometry, self.chosen.sizes)

    def _repr_html_(self) -> str:
        from hdcal.design.document import inverse_document
        from hdcal.design.summary import inverse_answer
        from hdcal.report.html import notebook_html

        return notebook_html(inverse_document(inverse_answer(self)))


def inverse_design(
    source: Posterior | Gear,
    vary: Mapping[str, tuple[float, float]],
    limit_force: float,
    *,
    deformation: float | None = None,
    temperatures: Sequence[float] | None = None,
    probability: float = 0.99,
    materials: Sequence[str] = (),
    limit_stress: float | None = None,
    tolerances: Mapping[str, float] | None = None,
    seed: int = 0,
) -> InverseDesign:
    """Find the sizes nearest to the tested gear that keep a force limit.

    Args:
        source: a calibration; or a gear, for what its priors say.
        vary: lowest and highest value of each free size [mm]: wall_thickness_mm,
            radius_mm, length_mm, load_height_mm.
        limit_force: that must not be exceeded [N].
        deformation: radial, of the gear [mm]; by default its nominal one.
        temperatures: at all of which the limits hold [°C]; by default the reference.
        probability: with which the next gear keeps each limit.
        materials: names or .toml files to choose among; by default the gear's own.
        limit_stress: largest hoop bending stress [MPa]; by default the material's
            yield strength where that is known.
        tolerances: ± of sizes [mm] by name, see `next_gear`.
        seed: of scatter and priors.

    Returns:
        The design nearest to the tested gear, and the others.

    Raises:
        NotUsable: the calibration failed its checks.
        InputError: bad input, or nothing inside the bounds keeps the limits.
    """
    basis = basis_of(source, seed=seed)
    nominal = basis.nominal_deformation
    at = deformation if deformation is not None else nominal
    levels = with_reference(basis, temperatures)
    findings = _findings(
        basis, vary, at, levels, limit_force, limit_stress, probability, materials
    )
    listed = materials or [basis.material]
    made = [attempt(findings, basis.of_material, name, seed) for name in listed]
    gear = attempt(findings, next_gear, basis, tolerances, seed)
    if findings or gear is None or at is None:
        raise InputError(findings)

    def target(of: Basis) -> Target:
        return Target.of(of, gear, levels, probability, limit_stress)

    found = [solve(one, target(one), vary, at, limit_force) for one in made if one]
    met = [one for one in found if one.met]
    if not met:
        raise InputError([_unmet(found, vary, at, limit_force, probability)])
    chosen = min(met, key=lambda one: one.change)
    sizes = {name: np.array([value]) for name, value in chosen.sizes.items()}
    kept = target(chosen.basis)
    return InverseDesign(
        basis,
        gear,
        dict(vary),
        at,
        levels,
        limit_force,
        limit_stress,
        probability,
        chosen,
        tuple(found),
        candidate(basis, target(basis), {}, at, limit_force),
        kept,
        elasticities(chosen, kept, at),
        (
            *beyond_tested(basis, np.array([at]), levels),
            *far_from_tested(basis, sizes),
            *basis.misfits,
        ),
    )


def _unmet(found, vary, deformation, limit, probability) -> Finding:
    best = min(found, key=lambda one: max(one.force / limit, one.utilisation or 0.0))
    ranges = " and ".join(
        f"{named(name)} between {low:g} and {high:g} mm"
        for name, (low, high) in vary.items()
    )
    at = ", ".join(
        f"{named(name)} {value:.4g} mm" for name, value in best.sizes.items()
    )
    stress = ""
    if best.utilisation is not None:
        stress = f" and {best.utilisation:.3g} of the allowed stress"
    words = (
        f"no {ranges or 'material'} meets {limit:g} N at {deformation:g} mm with "
        f"probability {probability:g}: the best ({at or best.basis.material}) gives "
        f"{best.force:.4g} N{stress}"
    )
    remedy = "Widen the bounds, free another size, or allow more force"
    return Finding("--limit-force", words, remedy)


def _findings(
    basis: Basis, vary, deformation, temperatures, force, stress, probability, materials
) -> list[Finding]:
    findings = name_findings(vary, SIZES, "--vary")
    if not vary and not materials:
        words = "nothing may change"
        remedy = "Free a size, e.g. --vary wall_thickness_mm=0.5:0.8"
        findings.append(Finding("--vary", words, remedy))
    for option, value, unit in (
        ("--limit-force", force, "N"),
        ("--limit-stress", stress, "MPa"),
    ):
        if value is not None and not 0.0 < value < np.inf:
            words = f"{value:g} is no limit"
            findings.append(Finding(option, words, f"Give it in {unit}, above zero"))
    findings += probability_findings(basis, probability)
    if name_findings(vary, SIZES, "--vary"):
        return findings
    for name, (low, high) in vary.items():
        if not low < high:
            words = f"{name} = {low:g}:{high:g} is empty"
            findings.append(Finding("--vary", words, "Write NAME=LO:HI"))
    findings += unseen_findings(vary, basis.theory, "--vary")
    sizes = {name: np.asarray(ends, float) for name, ends in vary.items()}
    findings += size_findings(basis, sizes, "--vary")
    if deformation is None:
        return [*findings, no_deformation()]
    radius = float(np.min(sizes.get("radius_mm", basis.gear.geometry.radius)))
    return findings + place_findings(
        basis, np.array([float(deformation)]), temperatures, radius
    )
