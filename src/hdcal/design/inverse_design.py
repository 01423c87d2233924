"""Inverse design: the sizes that keep a force limit, with the least change.

Of all sizes inside their bounds with

    F ≤ limit and stress ≤ strength, each with the required probability,

the ones nearest to the tested gear are chosen: least Σ (ln x/x₀)², since K was found
there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, InstanceOf, ValidationInfo, field_validator
from scipy.optimize import minimize

from hdcal.data.gear_file.validation import fault, requested, within
from hdcal.design import request
from hdcal.design.charts import limit_chart
from hdcal.design.gears import Gears, Sizes, calibrated_gears
from hdcal.design.result import DesignResult, Stress, shared_fields
from hdcal.errors import Finding, InputError
from hdcal.prediction.models import Models
from hdcal.report.charts.chart_spec import Chart
from hdcal.report.item import Interval, Probability, quantity
from hdcal.report.words import digits

# A limit this many times larger or smaller than the force is a slip of the unit.
_OFF = 100.0
# A limit counts as kept when it is exceeded by less than this share of itself.
CLOSE = 1e-6

Force = Annotated[float, within("force")]
Strength = Annotated[float, within("limit_stress")]


class LimitAsked(request.Asked):
    """The request for an inverse design; limits are sizes, forces have a sign."""

    deformation_mm: request.NominalDeformation = Field(validation_alias="deformation")
    limit_force_N: Force = Field(validation_alias="limit_force")
    limit_stress_MPa: Strength | None = Field(validation_alias="limit_stress")
    bounds: dict[request.SizeName, request.Bounds] = Field(validation_alias="vary")

    @property
    def sense(self) -> int:
        """Sense of loading: +1 where the gear is pressed, −1 where it is pulled."""
        return -1 if self.deformation_mm < 0.0 else 1

    @field_validator("limit_force_N")
    @classmethod
    def _check_limit(cls, limit: float, info: ValidationInfo) -> float:
        gears, at = request.gears_of(info), info.data.get("deformation_mm")
        if at is None:
            return limit
        usual = abs(np.median(gears.forces([at], [gears.gear.reference_temperature])))
        if limit < 0.0 < at or not usual / _OFF <= abs(limit) <= usual * _OFF:
            words = f"{limit:g} N is not plausible: {at:g} mm needs about "
            words += f"{digits(usual, 3)} N"
            raise fault(words, "Give it in N, with the sign of the deformation")
        return abs(limit)

    @field_validator("bounds")
    @classmethod
    def _check_bounds(cls, bounds: dict, info: ValidationInfo) -> dict:
        if not bounds:
            raise fault("no size is varied", "Vary a size: wall_thickness_mm=0.5:0.8")
        at = info.data.get("deformation_mm", 0.0)
        request.check_sizes(request.gears_of(info), bounds, at)
        return bounds


class Candidate(Stress):
    """Sizes with their force and stress; the distance is √Σ (ln x/x₀)².

    What is kept is not exceeded with the required probability.
    """

    sizes_mm: dict[str, float] = quantity("sizes", "mm")
    met: bool = quantity("limits kept")
    change: float = quantity("distance from the tested gear")
    force_N: Interval = quantity("force", "N")
    force_kept_N: float = quantity("force kept", "N")
    probability: Probability = quantity("probability of keeping the limit")
    utilisation_kept: float | None = quantity("share of the allowed stress kept")

    @property
    def sizes(self) -> dict[str, float]:
        """Sizes [mm] by name with the unit, such as `radius_mm`."""
        return {f"{name}_mm": value for name, value in self.sizes_mm.items()}

    def columns(self) -> dict[str, Any]:
        """Return numbers and texts by column, the sizes among them."""
        return super().columns() | self.sizes


@dataclass(frozen=True)
class LimitedGears:
    """The next gears at the worst temperature, and their limits."""

    gears: Gears
    asked: LimitAsked

    def forces(self, sizes: Sizes) -> np.ndarray:
        """Return the largest force over the temperatures of each draw [N]."""
        levels, at = self.asked.temperature_C, abs(self.asked.deformation_mm)
        factor = self.gears.factor(sizes)
        return self.gears.forces([at] * len(levels), levels, factor).max(axis=0)

    def stresses(self, sizes: Sizes) -> tuple[np.ndarray, np.ndarray | None]:
        """Return the largest stress of each draw [MPa], and its share of the limit."""
        at, limit = abs(self.asked.deformation_mm), self.asked.limit_stress_MPa
        stress = self.gears.stresses(sizes, at, self.asked.temperature_C)
        strength = self.gears.strengths() if limit is None else limit
        return stress, None if strength is None else stress / strength

    def kept(self, values: np.ndarray) -> float:
        """Return what is not exceeded with at least the required probability."""
        rank = ceil(self.asked.probability * len(values) - 1e-9) - 1
        return float(np.partition(values, rank)[rank])

    def excess(self, sizes: Sizes) -> np.ndarray:
        """Return logarithms of the kept force and stress over what is allowed."""
        force = self.kept(self.forces(sizes)) / self.asked.limit_force_N
        _, used = self.stresses(sizes)
        return np.log([force] if used is None else [force, self.kept(used)])

    def candidate(self, sizes: Mapping[str, float]) -> Candidate:
        """Return force, stress and probability of given sizes [mm]."""
        gears, sense, least = self.gears, self.asked.sense, 0.5 / self.gears.independent
        forces, (stress, used) = self.forces(sizes), self.stresses(sizes)
        steps = [np.log(value / gears.size_of(name)) for name, value in sizes.items()]
        kept = forces <= self.asked.limit_force_N * (1.0 + CLOSE)
        return Candidate(
            **dict(Stress.of(gears, stress)),
            sizes_mm={name.removesuffix("_mm"): value for name, value in sizes.items()},
            met=bool(np.max(self.excess(sizes)) <= CLOSE),
            change=float(np.linalg.norm(steps)),
            force_N=Interval.of(sense * forces),
            force_kept_N=sense * self.kept(forces),
            probability=float(np.clip(np.mean(kept), least, 1.0 - least)),
            utilisation_kept=None if used is None else self.kept(used),
        )

    def nearest(self) -> Candidate:
        """Return the sizes nearest to the tested ones that keep the limits, if any.

        In the logarithms of the sizes the limits are nearly straight.
        """
        bounds = np.log([*self.asked.bounds.values()])
        start = np.log([self.gears.size_of(name) for name in self.asked.bounds])

        def sizes(logs: np.ndarray) -> dict[str, float]:
            values = map(float, np.exp(logs))
            return dict(zip(self.asked.bounds, values, strict=True))

        inside = np.clip(start, *bounds.T)
        if np.max(self.excess(sizes(inside))) > CLOSE:
            inside = minimize(
                lambda logs: float(np.sum((logs - start) ** 2)),
                inside,
                bounds=bounds,
                constraints={"type": "ineq", "fun": lambda y: -self.excess(sizes(y))},
                method="SLSQP",
                options={"maxiter": 200, "ftol": 1e-14},
            ).x
        return self.candidate(sizes(np.clip(inside, *bounds.T)))


class InverseDesign(DesignResult):
    """The sizes that keep the limits with the least change."""

    template = "design/inverse_design.md.j2"
    table = "designs"

    format: Literal["hdcal.design/1"] = "hdcal.design/1"
    kind: Literal["inverse_geometry"] = "inverse_geometry"
    asked: LimitAsked
    design: Candidate
    tested: Candidate
    target: InstanceOf[LimitedGears] = Field(exclude=True)

    @property
    def designs(self) -> tuple[Candidate, ...]:
        """The tested gear and the design."""
        return self.tested, self.design

    def make_charts(self) -> Mapping[str, Chart]:
        """Return force against limit."""
        return {"design": limit_chart(self)}


def inverse_design(
    models: Models,
    vary: Mapping[str, tuple[float, float]],
    limit_force: float,
    *,
    deformation: float | None = None,
    temperatures: Sequence[float] | None = None,
    probability: float = 0.99,
    limit_stress: float | None = None,
    tolerances: Mapping[str, float] | None = None,
    seed: int = 0,
) -> InverseDesign:
    """Find the sizes nearest to the tested gear that keep a force limit.

    Args:
        models: from `calibrate` or `diagnose`.
        vary: lowest and highest value of each free size [mm]: wall_thickness_mm,
            radius_mm, length_mm, load_height_mm.
        limit_force: not to be exceeded [N]: its size, or with the force's sign.
        deformation: radial [mm], negative where pulled; by default the nominal one.
        temperatures: of all limits [°C]; by default the reference.
        probability: with which the next gear keeps each limit.
        limit_stress: largest hoop bending stress [MPa]; by default the yield strength.
        tolerances: ± of sizes [mm] by name; sizes are uniform within them.
        seed: of the scatter.

    Raises:
        NotUsable: the calibration failed its checks.
        InputError: invalid input, or nothing inside the bounds keeps the limits.
    """
    tested = calibrated_gears(models, seed)
    asked = requested(
        LimitAsked,
        tested,
        deformation=deformation,
        limit_force=limit_force,
        limit_stress=limit_stress,
        vary=dict(vary),
        temperatures=temperatures,
        probability=probability,
        tolerances=dict(tolerances or {}),
    )
    gears = tested.next_ones(asked.tolerances_mm, seed, asked.sense)
    target = LimitedGears(gears, asked)
    best = target.nearest()
    if not best.met:
        raise InputError([_unmet(best, asked)])
    place = asked.deformation_mm, asked.temperature_C
    return InverseDesign(
        **shared_fields(gears, *place, best.sizes),
        asked=asked,
        design=best,
        tested=target.candidate({name: gears.size_of(name) for name in asked.bounds}),
        target=target,
    )


def _unmet(best: Candidate, asked: LimitAsked) -> Finding:
    at = ", ".join(f"{name} {value:.4g}" for name, value in best.sizes.items())
    words = f"no design keeps {asked.limit_force_N:g} N: the best, {at}, needs "
    words += f"{digits(best.force_kept_N, 4)} N at {best.stress_MPa.median:.3g} MPa"
    remedy = "Widen the bounds, vary another size, or allow more force or stress"
    return Finding("limit_force", words, remedy)
