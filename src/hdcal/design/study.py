"""A parameter study: the force on gears with every combination of some sizes."""

from collections.abc import Mapping, Sequence
from math import prod
from typing import Annotated, Literal

import numpy as np
import pandas as pd
from pydantic import Field, InstanceOf, ValidationInfo, computed_field, field_validator

from hdcal.data.gear_file.validation import requested, within
from hdcal.design import request
from hdcal.design.charts import study_chart
from hdcal.design.gears import Gears, calibrated_gears
from hdcal.design.result import DesignResult, shared_fields
from hdcal.errors import Finding, InputError
from hdcal.physics.theory import peak_stress
from hdcal.prediction.models import Models
from hdcal.prediction.sizes import SIZES
from hdcal.report.charts.chart_spec import Chart
from hdcal.report.item import Item

PLACE = ["deformation_mm", "temperature_C"]
MOST_DESIGNS = 100_000
# Forces held at a time [numbers]: 16 MB.
_BLOCK = 2_000_000


class StudyAsked(Item):
    """The request for a study: values of sizes, deformations and temperatures."""

    deformation_mm: tuple[request.NominalDeformation, ...] = Field(
        validation_alias="deformation"
    )
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
    """The force of every design, with the sign of the deformation, and its stress.

    The columns that were varied are in the order given.
    """

    template = "design/study.md.j2"
    table = "designs"

    format: Literal["hdcal.study/1"] = "hdcal.study/1"
    designs: InstanceOf[pd.DataFrame] = Field(exclude=True)
    varied: tuple[str, ...]

    @computed_field(alias="columns")
    @property
    def columns_of_designs(self) -> dict[str, tuple[float, ...]]:
        """The designs by column; study.csv."""
        return {str(name): tuple(each) for name, each in self.designs.items()}

    def to_frame(self) -> pd.DataFrame:
        """Return the designs."""
        return self.designs

    def make_charts(self) -> Mapping[str, Chart]:
        """Return the force over the size that was varied first."""
        return {"study": study_chart(self)}


def study(
    models: Models,
    vary: Mapping[str, Sequence[float]],
    *,
    deformation: float | None = None,
    temperature: float | None = None,
    interval: float = 0.95,
    seed: int = 0,
) -> Study:
    """Compute the force on a gear for every combination of sizes.

    Args:
        models: from `calibrate` or `diagnose`.
        vary: values by name: wall_thickness_mm, radius_mm, length_mm, load_height_mm,
            deformation_mm, temperature_C.
        deformation: radial, of the gear, of either sign [mm]; by default its nominal
            one.
        temperature: [°C]; by default the reference temperature.
        interval: probability inside the band.
        seed: of what the draws leave open.

    Raises:
        NotUsable: the calibration failed its checks.
        InputError: the request is invalid.
    """
    gears = calibrated_gears(models, seed)
    warm = gears.gear.reference_temperature if temperature is None else temperature
    axes = {"deformation_mm": [deformation], "temperature_C": [warm], **vary}
    # In the given order, the others last.
    axes = {name: np.ravel(axes[name]).tolist() for name in (*vary, *axes)}
    count = prod(map(len, axes.values()))
    if not 1 <= count <= MOST_DESIGNS:
        words = f"{count} designs; 1 to {MOST_DESIGNS} are possible"
        remedy = "Vary fewer sizes, or use fewer steps"
        raise InputError([Finding("vary", words, remedy)])
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
    place = asked.deformation_mm, asked.temperature_C
    return Study(
        **shared_fields(gears, *place, asked.sizes, interval),
        designs=_designs(gears, grid.to_frame(False), interval),
        varied=tuple(name for name, values in axes.items() if len(values) > 1),
    )


def _designs(gears: Gears, table: pd.DataFrame, interval: float) -> pd.DataFrame:
    """Return the designs with their forces and stresses."""
    sizes = {name: table[name].to_numpy() for name in table if name in SIZES}
    at, warm = table[PLACE].to_numpy(float).T
    factor = np.broadcast_to(gears.factor(sizes), at.shape)
    tails = [0.5, 0.5 - interval / 2.0, 0.5 + interval / 2.0]
    forces = force_quantiles(gears, at, warm, factor, tails)
    for name, each in zip(("median", "lo", "hi"), forces, strict=True):
        table[f"force_{name}_N"] = each
    modulus, loss = (np.median(gears.model.draws[name]) for name in ("E0", "alpha"))
    modulus = modulus * (1.0 - loss * (warm - gears.gear.reference_temperature))
    table["stress_MPa"] = peak_stress(gears.made(sizes), modulus, np.abs(at))
    return table


def force_quantiles(gears: Gears, at, warm, factor, shares) -> np.ndarray:
    """Return quantiles of the force over the draws for every design [N], (q, d)."""
    step = max(1, _BLOCK // gears.model.size)
    rows = (slice(start, start + step) for start in range(0, len(at), step))
    blocks = (gears.forces(at[part], warm[part], factor[part]) for part in rows)
    return np.concatenate([np.quantile(f, shares, axis=1) for f in blocks], axis=1)
