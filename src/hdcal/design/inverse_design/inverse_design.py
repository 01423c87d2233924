"""Inverse geometry: the sizes that keep a force limit, with the least change.

Of all sizes inside their bounds with

    F ≤ limit and stress ≤ strength, each with the required probability,

both in size, along the sense of loading (`hdcal.prediction.engine.loading_sense`), the
ones nearest to the tested gear are chosen: least Σ (ln x/x₀)², since K was found there.
Solved by sequential quadratic programming on the logarithms of the sizes, with exact
derivatives of the model.
"""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Literal

import numpy as np
from pydantic import Field, InstanceOf, computed_field

from hdcal.data.case import Gear
from hdcal.design.design_draws import DesignDraws, design_draws
from hdcal.design.design_result import DesignResult
from hdcal.design.extrapolation import extrapolations, far_sizes
from hdcal.design.inverse_design.candidate import (
    Candidate,
    best_candidate,
    candidate,
    elasticities,
)
from hdcal.design.inverse_design.charts import limit_chart
from hdcal.design.inverse_design.force_limit import LimitedGear
from hdcal.design.inverse_design.limit import LimitAsked, limit_findings
from hdcal.design.next_gear import NextGear, next_gear
from hdcal.design.ring_chart import ring_chart
from hdcal.design.sizes import geometry_with, named, with_reference
from hdcal.errors import Finding, Findings, InputError
from hdcal.prediction.engine.models import Models
from hdcal.report.chart_spec import Chart
from hdcal.report.item import Words


class InverseDesign(DesignResult):
    """The sizes that keep the limits with the least change.

    Attributes:
        asked: limits, conditions and bounds.
        design: the candidate nearest to the tested gear.
        tested: the tested gear itself.
        candidates: the best sizes of each material.
        elasticities: d ln F / d ln x of the kept force at the chosen sizes.
        target: the population of the chosen material, and its limits.
    """

    template = "design/inverse_design/report.md.j2"
    table = "candidates"

    format: Literal["hdcal.design/1"] = "hdcal.design/1"
    kind: Literal["inverse_geometry"] = "inverse_geometry"
    asked: LimitAsked
    design: Candidate
    tested: Candidate
    candidates: tuple[Candidate, ...]
    elasticities: dict[str, float]
    target: InstanceOf[LimitedGear] = Field(exclude=True)

    @computed_field
    @property
    def population(self) -> Words:
        """The gears that the probabilities refer to."""
        return self.line("population")

    @property
    def as_tested(self) -> bool:
        """Whether the chosen design is the tested gear itself."""
        same = self.design.material == self.tested.material
        return same and self.design.change < 1e-9

    def make_charts(self) -> Mapping[str, Chart]:
        """Return force against limit if sizes are free, and the shape of the ring."""
        charts = {"design": self._limit_chart} if self.asked.bounds else {}
        ring = geometry_with(self.source.gear.geometry, self.design.sizes)
        modulus = float(np.median(np.asarray(self.target.gears.values["E0"])))
        profile = ring_chart(ring, modulus, self.asked.deformation_mm)
        return charts | {"profile": profile}

    @cached_property
    def _limit_chart(self) -> Chart:
        return limit_chart(self)


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
        source: a calibration; or a gear, to use its priors.
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
        InputError: invalid input, or nothing inside the bounds keeps the limits.
    """
    draws = design_draws(source, seed=seed)
    at = draws.nominal_deformation if deformation is None else deformation
    asked = LimitAsked(
        # Without a number the finding about it is reported with the others.
        deformation_mm=np.nan if at is None else at,
        temperature_C=with_reference(draws, temperatures).tolist(),
        limit_force_N=abs(limit_force),
        limit_stress_MPa=limit_stress,
        probability=probability,
        bounds=dict(vary),
        tolerances_mm=dict(tolerances or {}),
    )
    with Findings() as wrong:
        wrong += limit_findings(draws, asked, materials, limit_force)
        listed = materials or [draws.material]
        made = [wrong.attempt(draws.of_material, name, seed) for name in listed]
        # Sizes that are not positive have a finding already.
        smallest = {name: low for name, (low, _) in vary.items() if low > 0.0}
        gear = wrong.attempt(next_gear, draws, asked.tolerances_mm, seed, smallest)
    assert gear is not None
    return _nearest_design(draws, [one for one in made if one], gear, asked)


def _nearest_design(
    draws: DesignDraws, made: Sequence[DesignDraws], gear: NextGear, asked: LimitAsked
) -> InverseDesign:
    """Return the nearest to the tested gear of the designs of all materials."""
    targets = [LimitedGear.of(one, gear, asked) for one in made]
    found = [
        best_candidate(one, target, asked.bounds)
        for one, target in zip(made, targets, strict=True)
    ]
    met = [row for row, one in enumerate(found) if one.met]
    if not met:
        raise InputError([_unmet(found, asked)])
    best = min(met, key=lambda row: found[row].change)
    chosen, target = found[best], targets[best]
    place = np.array([asked.deformation_mm]), np.asarray(asked.temperature_C)
    sizes = {name: np.array([value]) for name, value in chosen.sizes.items()}
    return InverseDesign(
        source=draws,
        materials=(chosen.material,),
        extrapolations=tuple(extrapolations(draws, *place)),
        far_sizes=far_sizes(draws, sizes),
        interval_kind=gear.interval_kind(draws),
        asked=asked,
        design=chosen,
        tested=candidate(draws, LimitedGear.of(draws, gear, asked), {}),
        candidates=tuple(found),
        elasticities=elasticities(target, chosen.sizes),
        target=target,
    )


def _unmet(found: Sequence[Candidate], asked: LimitAsked) -> Finding:
    limit, sense = asked.limit_force_N, asked.sense

    def excess(one: Candidate) -> float:
        return max(sense * one.force_N.kept / limit, one.utilisation_kept or 0.0)

    best = min(found, key=excess)
    ranges = " and ".join(
        f"{named(name)} between {low:g} and {high:g} mm"
        for name, (low, high) in asked.bounds.items()
    )
    at = ", ".join(
        f"{named(name)} {value:.4g} mm" for name, value in best.sizes.items()
    )
    stress = ""
    if best.utilisation_kept is not None:
        stress = f" and {best.utilisation_kept:.3g} of the allowed stress"
    words = (
        f"no {ranges or 'material'} meets {limit:g} N at "
        f"{asked.deformation_mm:g} mm with probability "
        f"{asked.probability:g}: the best ({at or best.material}) "
        f"gives {best.force_N.kept:.4g} N{stress}"
    )
    remedy = "Widen the bounds, free another size, or allow more force"
    return Finding("limit_force", words, remedy)
