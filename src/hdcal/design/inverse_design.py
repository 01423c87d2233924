"""Inverse geometry: the sizes that keep a force limit, with the least change.

Of all sizes inside their bounds with

    F ≤ limit and stress ≤ strength, each with the required probability,

both in size, along the sense of loading (`hdcal.prediction.engine.loading_sense`), the
ones nearest to the tested gear are chosen: least Σ (ln x/x₀)², since K was found there.
Solved by sequential quadratic programming on the logarithms of the sizes, with exact
derivatives of the model.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Gear
from hdcal.data.plausible import implausible
from hdcal.data.records import Geometry
from hdcal.design.answer import LimitAsked
from hdcal.design.candidate import Candidate, best_candidate, candidate, elasticities
from hdcal.design.checks import (
    name_findings,
    no_deformation,
    place_findings,
    probability_findings,
    size_findings,
    unseen_findings,
)
from hdcal.design.design_draws import DesignDraws, design_draws
from hdcal.design.force_limit import LimitedGear
from hdcal.design.next_gear import NextGear, next_gear
from hdcal.design.sentences import beyond_tested, far_from_tested
from hdcal.design.sizes import (
    geometry_with,
    named,
    with_reference,
)
from hdcal.errors import Finding, Findings, InputError
from hdcal.notebook import Shown
from hdcal.prediction.engine.conditions import slip_findings
from hdcal.prediction.engine.loading_sense import capacity_findings
from hdcal.prediction.engine.models import Models
from hdcal.prediction.engine.sizes import SIZES


@dataclass(frozen=True, repr=False)
class InverseDesign(Shown):
    """The design that keeps the limits, and what it was chosen among.

    Attributes:
        basis: what the draws belong to.
        gear: whom the limits are for.
        asked: limits, place and bounds.
        chosen: the nearest to the tested gear.
        candidates: one for each material.
        tested: the tested gear itself.
        target: what was kept, of the chosen material.
        elasticities: d ln F / d ln x of the kept force at the chosen design.
        warnings: what is extrapolated, in words.
    """

    basis: DesignDraws
    gear: NextGear
    asked: LimitAsked
    chosen: Candidate
    candidates: tuple[Candidate, ...]
    tested: Candidate
    target: LimitedGear
    elasticities: Mapping[str, float]
    warnings: tuple[str, ...]

    @property
    def drawing(self) -> Geometry:
        """The chosen gear's sizes [mm]."""
        return geometry_with(self.basis.gear.geometry, self.chosen.sizes)


def inverse_design(
    source: Models | Gear,
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
        limit_force: not to be exceeded [N]: its size, or with the force's sign.
        deformation: radial, with its sign [mm]; by default the gear's nominal one.
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
    draws = design_draws(source, seed=seed)
    at = draws.nominal_deformation if deformation is None else deformation
    # Without any number the finding about it is told with the others.
    at = np.nan if at is None else at
    levels = tuple(with_reference(draws, temperatures).tolist())
    limits = abs(limit_force), limit_stress, probability
    asked = LimitAsked(at, levels, *limits, dict(vary), dict(tolerances or {}))
    with Findings() as wrong:
        wrong += _findings(draws, asked, materials, limit_force)
        listed = materials or [draws.material]
        made = [wrong.attempt(draws.of_material, name, seed) for name in listed]
        # What is no size at all is told as such.
        smallest = {name: low for name, (low, _) in vary.items() if low > 0.0}
        gear = wrong.attempt(next_gear, draws, asked.tolerances_mm, seed, smallest)
    assert gear is not None
    return _nearest_design(draws, filter(None, made), gear, asked)


def _nearest_design(
    draws: DesignDraws, made: Iterable[DesignDraws], gear: NextGear, asked: LimitAsked
) -> InverseDesign:
    """Return the nearest to the tested gear of the designs of all materials."""
    vary = asked.bounds
    found = [
        best_candidate(one, LimitedGear.of(one, gear, asked), vary) for one in made
    ]
    met = [one for one in found if one.met]
    if not met:
        raise InputError([_unmet(found, asked)])
    chosen = min(met, key=lambda one: one.change)
    kept = LimitedGear.of(chosen.basis, gear, asked)
    place = np.array([asked.deformation_mm]), np.asarray(asked.temperature_C)
    sizes = {name: np.array([value]) for name, value in chosen.sizes.items()}
    return InverseDesign(
        basis=draws,
        gear=gear,
        asked=asked,
        chosen=chosen,
        candidates=tuple(found),
        tested=candidate(draws, LimitedGear.of(draws, gear, asked), {}),
        target=kept,
        elasticities=elasticities(kept, chosen.sizes),
        warnings=(
            *beyond_tested(draws, *place),
            *far_from_tested(draws, sizes),
            *draws.misfits,
        ),
    )


def _unmet(found: Sequence[Candidate], asked: LimitAsked) -> Finding:
    limit = asked.limit_force_N
    best = min(found, key=lambda one: max(one.force / limit, one.utilisation or 0.0))
    ranges = " and ".join(
        f"{named(name)} between {low:g} and {high:g} mm"
        for name, (low, high) in asked.bounds.items()
    )
    at = ", ".join(
        f"{named(name)} {value:.4g} mm" for name, value in best.sizes.items()
    )
    stress = ""
    if best.utilisation is not None:
        stress = f" and {best.utilisation:.3g} of the allowed stress"
    words = (
        f"no {ranges or 'material'} meets {limit:g} N at "
        f"{asked.deformation_mm:g} mm with probability "
        f"{asked.probability:g}: the best ({at or best.basis.material}) "
        f"gives {asked.sense * best.force:.4g} N{stress}"
    )
    remedy = "Widen the bounds, free another size, or allow more force"
    return Finding("limit_force", words, remedy)


def _findings(
    draws: DesignDraws, asked: LimitAsked, materials, limit_force: float
) -> list[Finding]:
    vary, place = asked.bounds, f"{asked.deformation_mm:g} mm"
    findings = name_findings(vary, SIZES, "vary")
    findings += capacity_findings("limit_force", limit_force, asked.sense, place)
    if not vary and not materials:
        words = "nothing may change"
        remedy = "Free a size, e.g. wall_thickness_mm=0.5:0.8"
        findings.append(Finding("vary", words, remedy))
    for name, value, unit in (
        ("limit_force", asked.limit_force_N, "N"),
        ("limit_stress", asked.limit_stress_MPa, "MPa"),
    ):
        wrong = implausible(name, value)
        if value == 0.0 and not wrong:
            wrong = [Finding(name, "0 is no limit", f"Give it in {unit}")]
        elif name == "limit_force" and not wrong:
            at = asked.deformation_mm
            wrong = slip_findings(name, limit_force, draws.usual_force(at), at)
        findings += wrong
    findings += probability_findings(draws, asked.probability)
    if any(name not in SIZES for name in vary):
        return findings
    for name, (low, high) in vary.items():
        if not low < high:
            words = f"{name} = {low:g}:{high:g} is empty"
            findings.append(Finding("vary", words, "Write NAME=LO:HI"))
    findings += unseen_findings(draws, vary)
    sizes = {name: np.asarray(ends, float) for name, ends in vary.items()}
    findings += size_findings(draws, sizes)
    if np.isnan(asked.deformation_mm):
        return [*findings, no_deformation()]
    radius = float(np.min(sizes.get("radius_mm", draws.gear.geometry.radius)))
    place = np.array([asked.deformation_mm]), np.asarray(asked.temperature_C)
    return findings + place_findings(draws, *place, radius)
