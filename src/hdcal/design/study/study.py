"""A parameter study: the force on gears with every combination of some sizes."""

from collections.abc import Hashable, Mapping, Sequence
from math import prod
from typing import Annotated, Any, Literal

import numpy as np
import pandas as pd
from pydantic import Field, computed_field

from hdcal.data.case import Gear
from hdcal.data.plausible import implausible
from hdcal.design.checks import (
    name_findings,
    no_deformation,
    place_findings,
    size_findings,
    unused_findings,
)
from hdcal.design.design_draws import DesignDraws, design_draws
from hdcal.design.design_result import DesignResult
from hdcal.design.extrapolation import extrapolations, far_sizes
from hdcal.design.sizes import geometry_with
from hdcal.design.study.charts import study_chart
from hdcal.design.study.force_quantiles import force_quantiles
from hdcal.errors import Finding, Findings, InputError
from hdcal.physics.profile import peak_stress
from hdcal.prediction.engine.models import Models
from hdcal.prediction.engine.sizes import SIZES, stiffness_ratio
from hdcal.report.chart_spec import Chart
from hdcal.report.item import Interval
from hdcal.report.markdown import MOST_ROWS

AXES = (*SIZES, "deformation_mm", "temperature_C")
MOST_DESIGNS, MOST_AXES, MOST_MATERIALS = 100_000, 4, 20
Axes = dict[str, np.ndarray]
_FORCES = ("force_median_N", "force_lo_N", "force_hi_N")
_COLUMNS = ("material", *_FORCES, "stress_MPa")


class Study(DesignResult):
    """The force of every design.

    Attributes:
        designs: an entry of each column per design: material, the sizes, deformation
            and temperature by name; force_median_N, force_lo_N, force_hi_N with the
            sign of the deformation; stress_MPa, the median size of the hoop bending
            stress under the load.
        varied: names of the columns that were varied, in the order given.
        interval: probability inside the band.
    """

    template = "design/study/report.md.j2"
    table = "designs"

    format: Literal["hdcal.study/1"] = "hdcal.study/1"
    designs: Annotated[Axes, Field(exclude=True)]
    varied: tuple[str, ...]

    @computed_field(alias="columns", json_schema_extra={"required": [*_COLUMNS]})
    @property
    def columns_of_designs(self) -> dict[str, tuple[float | str, ...]]:
        """The designs by column; study.csv."""
        return {name: tuple(each.tolist()) for name, each in self.designs.items()}

    @property
    def common(self) -> dict[str, float | str]:
        """Material, sizes and conditions that are the same in all designs."""
        columns = self.columns_of_designs
        varied = self.varied or ("deformation_mm",)
        return {
            name: columns[name][0]
            for name in ("material", *AXES)
            if name in columns and name not in varied and len({*columns[name]}) == 1
        }

    @property
    def rows(self) -> list[dict[Hashable, Any]]:
        """The first designs, each with the interval of its force."""
        first = self.to_frame()[:MOST_ROWS]
        forces = np.column_stack([first[name] for name in _FORCES])
        spans = [Interval(median=middle, lo=lo, hi=hi) for middle, lo, hi in forces]
        return first.assign(force=spans).to_dict("records")

    def to_frame(self) -> pd.DataFrame:
        """Return the designs."""
        return pd.DataFrame(dict(self.designs))

    def make_charts(self) -> Mapping[str, Chart]:
        """Return the force over the size that was varied first."""
        return {"study": study_chart(self)}


def study(
    source: Models | Gear,
    vary: Mapping[str, Sequence[float]],
    *,
    materials: Sequence[str] = (),
    deformation: float | None = None,
    temperature: float | None = None,
    interval: float = 0.95,
    seed: int = 0,
) -> Study:
    """Compute the force on a gear for every combination of sizes.

    Args:
        source: a calibration; or a gear, to use its priors.
        vary: values by name: wall_thickness_mm, radius_mm, length_mm, load_height_mm,
            deformation_mm, temperature_C.
        materials: names or .toml files; by default the gear's own.
        deformation: radial, of the gear, of either sign [mm]; by default its nominal
            one.
        temperature: [°C]; by default the reference temperature.
        interval: probability inside the band.
        seed: of the draws of priors.

    Returns:
        The designs, the last name of `vary` varying fastest.

    Raises:
        NotUsable: the calibration failed its checks.
        InputError: the request is invalid; it has every finding.
    """
    draws = design_draws(source, seed=seed)
    try:
        axes = {name: np.atleast_1d(np.asarray(v, float)) for name, v in vary.items()}
    except (TypeError, ValueError) as error:
        remedy = "Give numbers by name, and materials as `materials`"
        words = "a varied value is no number"
        raise InputError([Finding("vary", words, remedy)]) from error
    axes = _with_place(draws, axes, deformation, temperature)
    with Findings() as wrong:
        wrong += _findings(draws, axes, materials, interval)
        listed = materials or [draws.material]
        made = [wrong.attempt(draws.of_material, name, seed) for name in listed]
    return _tabulated(draws, list(filter(None, made)), axes, interval)


def _with_place(
    draws: DesignDraws,
    axes: Axes,
    deformation: float | None,
    temperature: float | None,
) -> Axes:
    """Return the axes with deformation and temperature among them."""
    nominal = draws.nominal_deformation
    # Without a number the finding about it is reported with the others.
    at = np.nan if nominal is None else nominal
    own = {
        "deformation_mm": at if deformation is None else deformation,
        "temperature_C": (
            draws.gear.reference_temperature if temperature is None else temperature
        ),
    }
    rest = {n: np.array([float(v)]) for n, v in own.items() if n not in axes}
    return {**axes, **rest}


def _findings(
    draws: DesignDraws, axes: Axes, materials: Sequence[str], interval: float
) -> list[Finding]:
    findings = name_findings(axes, AXES, "vary")
    if findings:
        return findings
    count = prod(len(values) for values in axes.values()) * max(len(materials), 1)
    many = sum(len(values) > 1 for values in axes.values())
    if count > MOST_DESIGNS:
        words = f"{count} designs are more than {MOST_DESIGNS}"
        findings.append(Finding("vary", words, "Vary less, or in fewer steps"))
    if many > MOST_AXES:
        words = f"{many} sizes at a time are more than {MOST_AXES}"
        findings.append(Finding("vary", words, "Vary fewer of them together"))
    if len(materials) > MOST_MATERIALS or len(set(materials)) < len(materials):
        words = f"more than {MOST_MATERIALS} materials, or one of them twice"
        findings.append(Finding("materials", words, "Name each of a few once"))
    findings += implausible("interval", interval)
    sizes = {name: values for name, values in axes.items() if name in SIZES}
    findings += unused_findings(draws, sizes)
    wrong = size_findings(draws, sizes)
    radius = sizes.get("radius_mm", np.array([draws.gear.geometry.radius]))
    least = float(np.min(radius)) if not wrong else np.inf
    at, warm = axes["deformation_mm"], axes["temperature_C"]
    if np.isnan(at).any():
        wrong.append(no_deformation())
        at = np.ones(1)
    names = "deformation", "temperature"
    return findings + wrong + place_findings(draws, at, warm, least, names)


def _tabulated(
    draws: DesignDraws, made: Sequence[DesignDraws], axes: Axes, interval: float
) -> Study:
    """Return the study.

    Args:
        draws: of the tested gear.
        made: of each material.
        axes: values of what is varied, by name.
        interval: probability inside the band.
    """
    tables = [_of_material(one, axes, interval) for one in made]
    sizes = {name: values for name, values in axes.items() if name in SIZES}
    varied = [name for name, values in axes.items() if len(values) > 1]
    place = axes["deformation_mm"], axes["temperature_C"]
    return Study(
        source=draws,
        materials=tuple(one.material for one in made),
        extrapolations=tuple(extrapolations(draws, *place)),
        far_sizes=far_sizes(draws, sizes),
        interval=interval,
        interval_kind=draws.interval_kind,
        designs={n: np.concatenate([t[n] for t in tables]) for n in tables[0]},
        varied=(*(["material"] if len(made) > 1 else []), *varied),
    )


def _of_material(draws: DesignDraws, axes: Axes, interval: float) -> Axes:
    grids = np.meshgrid(*axes.values(), indexing="ij")
    table = {name: grid.ravel() for name, grid in zip(axes, grids, strict=True)}
    sizes = {name: values for name, values in table.items() if name in SIZES}
    drawing = geometry_with(draws.drawing, sizes)
    at, warm = table["deformation_mm"], table["temperature_C"]
    factor = stiffness_ratio(drawing, draws.gear.geometry, draws.theory)
    factor = np.broadcast_to(factor, at.shape)
    tails = np.array([0.5, 0.5 - interval / 2.0, 0.5 + interval / 2.0])
    forces = force_quantiles(draws, factor, at, warm, tails)
    modulus, loss = (np.median(draws.values[name]) for name in ("E0", "alpha"))
    warm_modulus = modulus * (1.0 - loss * (warm - draws.gear.reference_temperature))
    stress = np.broadcast_to(peak_stress(drawing, warm_modulus, np.abs(at)), at.shape)
    return {
        "material": np.full(len(at), draws.material),
        **table,
        **dict(zip(_FORCES, forces, strict=True)),
        "stress_MPa": np.asarray(stress),
    }
