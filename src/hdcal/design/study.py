"""A parameter study: the force on gears with every combination of some sizes."""

from collections.abc import Mapping, Sequence
from math import prod
from typing import Annotated, Literal

import numpy as np
import pandas as pd
from pydantic import Field, InstanceOf, ValidationInfo, computed_field, field_validator

from hdcal.data.case import Gear
from hdcal.data.gear_file.validation import requested, within
from hdcal.design import request
from hdcal.design.charts import study_chart
from hdcal.design.gears import Gears, draw_gears
from hdcal.design.result import DesignResult, shared_fields
from hdcal.errors import Finding, Findings, InputError
from hdcal.physics.theory import peak_stress
from hdcal.prediction.models import Models
from hdcal.prediction.sizes import SIZES
from hdcal.report.charts.chart_spec import Chart
from hdcal.report.item import Item

PLACE = ["deformation_mm", "temperature_C"]
MOST_DESIGNS = 100_000
# Forces held at a time [numbers]: 16 MB.
_BLOCK = 2_000_000
_FORCES = ["force_median_N", "force_lo_N", "force_hi_N"]

Deformations = tuple[request.NominalDeformation, ...]


class StudyAsked(Item):
    """The request for a study: values of sizes, deformations and temperatures."""

    deformation_mm: Deformations = Field(validation_alias="deformation")
    temperature_C: tuple[request.Temperature, ...] = Field(
        validation_alias="temperature"
    )
    sizes: dict[request.SizeName, tuple[request.Size, ...]] = Field(
        validation_alias="vary"
    )
    interval: Annotated[float, within("interval")]

    @field_validator("sizes")
    @classmethod
    def _for_the_gear(cls, sizes: dict, info: ValidationInfo) -> dict:
        request.check_sizes(
            request.gears_of(info), sizes, info.data.get("deformation_mm", 0.0)
        )
        return sizes


class Study(DesignResult):
    """The force of every design.

    Attributes:
        designs: material, sizes, deformation, temperature, median and ends of the force
            with the sign of the deformation, and the median size of the hoop bending
            stress under the load.
        varied: names of the columns that were varied, in the order given.
    """

    template = "design/study.md.j2"
    table = "designs"

    format: Literal["hdcal.study/1"] = "hdcal.study/1"
    designs: InstanceOf[pd.DataFrame] = Field(exclude=True)
    varied: tuple[str, ...]

    @computed_field(alias="columns")
    @property
    def columns_of_designs(self) -> dict[str, tuple[float | str, ...]]:
        """The designs by column; study.csv."""
        return {str(name): tuple(each) for name, each in self.designs.items()}

    def to_frame(self) -> pd.DataFrame:
        """Return the designs."""
        return self.designs

    def make_charts(self) -> Mapping[str, Chart]:
        """Return the force over the size that was varied first."""
        return {"study": study_chart(self)}


def study(
    source: Models | Gear | Gears,
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

    Raises:
        NotUsable: the calibration failed its checks.
        InputError: the request is invalid.
    """
    gears = draw_gears(source, seed)
    warm = gears.gear.reference_temperature if temperature is None else temperature
    axes = {"deformation_mm": [deformation], "temperature_C": [warm], **vary}
    # In the given order, the others last.
    axes = {name: np.ravel(axes[name]).tolist() for name in (*vary, *axes)}
    listed = list(dict.fromkeys(materials)) or [gears.material]
    count = len(listed) * prod(map(len, axes.values()))
    if not 1 <= count <= MOST_DESIGNS:
        words = f"{count} designs are not between 1 and {MOST_DESIGNS}"
        raise InputError([Finding("vary", words, "Vary less, or in fewer steps")])
    with Findings() as wrong:
        made = [wrong.attempt(gears.of_material, name, seed) for name in listed]
        asked = requested(
            StudyAsked,
            gears,
            deformation=axes["deformation_mm"],
            temperature=axes["temperature_C"],
            vary={name: values for name, values in axes.items() if name not in PLACE},
            interval=interval,
        )
    known = {**asked.sizes, **dict(asked)}
    grid = pd.MultiIndex.from_product([known[n] for n in axes], names=[*axes])
    tables = [_of_material(one, grid.to_frame(False), interval) for one in made if one]
    varied = [name for name, values in axes.items() if len(values) > 1]
    place = asked.deformation_mm, asked.temperature_C
    return Study(
        **shared_fields(gears, *place, asked.sizes, interval),
        materials=tuple(listed),
        designs=pd.concat(tables, ignore_index=True),
        varied=(*(["material"] if len(tables) > 1 else []), *varied),
    )


def _of_material(gears: Gears, table: pd.DataFrame, interval: float) -> pd.DataFrame:
    """Return designs of one material, with their forces and stresses."""
    sizes = {name: table[name].to_numpy() for name in table if name in SIZES}
    at, warm = table[PLACE].to_numpy(float).T
    factor = np.broadcast_to(gears.factor(sizes), at.shape)
    tails = [0.5, 0.5 - interval / 2.0, 0.5 + interval / 2.0]
    table[_FORCES] = force_quantiles(gears, at, warm, factor, tails).T
    modulus, loss = (np.median(gears.values[name]) for name in ("E0", "alpha"))
    modulus = modulus * (1.0 - loss * (warm - gears.gear.reference_temperature))
    table["stress_MPa"] = peak_stress(gears.drawing(sizes), modulus, np.abs(at))
    table.insert(0, "material", gears.material)
    return table


def force_quantiles(gears: Gears, at, warm, factor, shares) -> np.ndarray:
    """Return quantiles of the force over the draws for every design [N], (q, d).

    Deformations [mm], temperatures [°C] and stiffnesses over that of the tested gear
    have the shape (d,).
    """
    effects = gears.model.effects if gears.model is not None else ()
    if not any(effect.stage == "force" for effect in effects):
        # A positive factor does not change the ranks of draws: the quantiles of the
        # tested gear hold for all sizes.
        (at, warm), which = np.unique([at, warm], axis=1, return_inverse=True)
        unit = _quantiles(gears, at, warm, np.ones(len(at)), shares)
        return unit[:, which.ravel()] * factor
    return _quantiles(gears, at, warm, factor, shares)


def _quantiles(gears: Gears, at, warm, factor, shares) -> np.ndarray:
    step = max(1, _BLOCK // gears.size)
    rows = (slice(start, start + step) for start in range(0, len(at), step))
    each = (gears.forces(at[part], warm[part], factor[part]) for part in rows)
    return np.concatenate([np.quantile(one, shares, axis=1) for one in each], axis=1)
