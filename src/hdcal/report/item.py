"""Items: the fields of results, with labels and units."""

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import AliasGenerator, BaseModel, ConfigDict, Field

from hdcal.quantities import Quantities

INTERVAL = 0.95
# Probabilities below the lower end, the median and the upper end of an interval.
TAILS = (0.5 * (1.0 - INTERVAL), 0.5, 0.5 * (1.0 + INTERVAL))

Words = Annotated[str, Field(min_length=1)]
Count = Annotated[int, Field(ge=0)]
EffectName = Annotated[str, Field(pattern="^[_A-Za-z][_A-Za-z0-9]*$")]
Digest = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
# A sum of probabilities may exceed one by rounding error.
Probability = Annotated[float, Field(ge=0.0, le=1.000001)]
# For charts; not in the JSON.
Draws = Annotated[np.ndarray, Field(exclude=True)]


def quantity(
    label: str, unit: str = "", *, column: str | None = None, **limits: Any
) -> Any:
    """Declare a field with a label, a unit, and a column other than its name.

    The limits are constraints, as of pydantic's `Field`.
    """
    extra: dict[str, Any] = {"unit": unit, "column": column}
    extra = {name: text for name, text in extra.items() if text}
    return Field(title=label, json_schema_extra=extra or None, **limits)


def _json_name(name: str) -> str:
    # `schema` is a method of pydantic's models, `from` a keyword.
    return "schema" if name == "format" else name.rstrip("_")


class Item(BaseModel):
    """Frozen fields with labels and units."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        arbitrary_types_allowed=True,
        alias_generator=AliasGenerator(serialization_alias=_json_name),
        serialize_by_alias=True,
        ser_json_inf_nan="null",
        json_schema_serialization_defaults_required=True,
    )

    @classmethod
    def label(cls, name: str) -> str:
        """Return label and unit of a field, for an axis."""
        title, unit = cls.model_fields[name].title or name, cls._extra(name, "unit")
        return f"{title} [{unit}]" if unit else title

    @classmethod
    def _extra(cls, name: str, key: str) -> str:
        extra = cls.model_fields[name].json_schema_extra
        return str(extra.get(key, "")) if isinstance(extra, Mapping) else ""

    def columns(self) -> dict[str, Any]:
        """Return numbers and texts by column.

        An interval `stiffness_N_per_mm` has the columns `stiffness_N_per_mm` of its
        median, `stiffness_lo` and `stiffness_hi`.
        """
        columns: dict[str, Any] = {}
        for name, field in type(self).model_fields.items():
            value = getattr(self, name)
            column = self._extra(name, "column") or _json_name(name)
            if isinstance(value, Interval):
                unit = self._extra(name, "unit").replace("/", "_per_")
                stem = column.removesuffix(f"_{unit}")
                columns |= {column: value.median}
                columns |= {f"{stem}_lo": value.lo, f"{stem}_hi": value.hi}
            elif isinstance(value, Item):
                columns |= {f"{column}_{n}": v for n, v in value.columns().items()}
            elif not field.exclude and not isinstance(value, tuple | dict):
                columns[column] = value
        return columns


class Interval(Item):
    """Median and ends of an equal-tailed interval."""

    median: float
    lo: float
    hi: float

    @property
    def size(self) -> "Interval":
        """The interval with its sign changed if the median is negative."""
        if self.median >= 0.0:
            return self
        return Interval(median=-self.median, lo=-self.hi, hi=-self.lo)

    @classmethod
    def of(cls, draws: np.ndarray, probability: float = INTERVAL) -> "Interval":
        """Return the equal-tailed interval of draws with this probability."""
        tail = (1.0 - probability) / 2.0
        lo, median, hi = np.quantile(draws, [tail, 0.5, 1.0 - tail])
        return cls(median=float(median), lo=float(lo), hi=float(hi))


def with_units(value: Any, plain: Any, units: Quantities) -> Any:
    """Return the JSON form `plain` of items with keys in the measured units."""
    if isinstance(value, Item):
        names = {_json_name(name): name for name in type(value).model_fields}
        held = {key: getattr(value, str(names.get(key, key))) for key in plain}
        return {units.key(k): with_units(held[k], plain[k], units) for k in plain}
    if isinstance(value, Mapping):
        return {k: with_units(item, plain[k], units) for k, item in value.items()}
    if isinstance(value, tuple):
        pairs = zip(value, plain, strict=True)
        return [with_units(item, form, units) for item, form in pairs]
    return plain
