"""Results that describe themselves: JSON, schema, table, chart and text follow.

A question declares its result as a subclass of `Result`. Labels and units stand in the
fields, sentences in the template of the question.
"""

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import (
    AliasGenerator,
    BaseModel,
    ConfigDict,
    Field,
    InstanceOf,
    computed_field,
)

from hdcal.quantities import FORCE, Quantities
from hdcal.report.chart_spec import RED, Chart
from hdcal.report.result_schema import DIALECT, ResultSchema, schema_with_units
from hdcal.report.sentences import rendered

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes

INTERVAL = 0.95
_FIRST = ("schema", "status", "reasons", "headline", "next_step")
# A failed result has reasons, any other result has none.
_RULE = {
    "if": {"properties": {"status": {"const": "failed"}}},
    "then": {"properties": {"reasons": {"minItems": 1}}},
    "else": {"properties": {"reasons": {"maxItems": 0}}},
}

Words = Annotated[str, Field(min_length=1)]
Count = Annotated[int, Field(ge=0)]
EffectName = Annotated[str, Field(pattern="^[A-Za-z_][A-Za-z0-9_]*$")]
Digest = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
# Sums of probabilities may exceed one by a rounding error.
Probability = Annotated[float, Field(ge=0.0, le=1.000001)]
# What charts need and JSON does not hold.
Draws = Annotated[np.ndarray, Field(exclude=True)]


def quantity(
    label: str, unit: str = "", *, column: str | None = None, **limits: Any
) -> Any:
    """Declare a field.

    Args:
        label: shown on axes and in tables.
        unit: of the number; empty for a dimensionless one.
        column: name in tables; by default the name of the field.
        limits: further constraints, as of pydantic's `Field`.
    """
    extra = {"unit": unit, "column": column}
    given = {name: text for name, text in extra.items() if text}
    return Field(title=label, json_schema_extra=given or None, **limits)


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
        """Return label and unit of a field, as an axis shows them."""
        title, unit = cls.model_fields[name].title or name, cls._extra(name, "unit")
        return f"{title} [{unit}]" if unit else title

    @classmethod
    def _extra(cls, name: str, key: str) -> str:
        extra = cls.model_fields[name].json_schema_extra
        return str(extra.get(key, "")) if isinstance(extra, Mapping) else ""

    def columns(self) -> dict[str, Any]:
        """Return numbers and texts keyed by column name.

        The ends of an interval stand beside its median as `_lo` and `_hi`: those of
        `stiffness_N_per_mm` are `stiffness_lo` and `stiffness_hi`.
        """
        found: dict[str, Any] = {}
        for name, field in type(self).model_fields.items():
            value = getattr(self, name)
            column = self._extra(name, "column") or _json_name(name)
            if isinstance(value, Interval):
                unit = self._extra(name, "unit").replace("/", "_per_")
                stem = column.removesuffix(f"_{unit}")
                found |= {column: value.median}
                found |= {f"{stem}_lo": value.lo, f"{stem}_hi": value.hi}
            elif isinstance(value, Item):
                inner = value.columns().items()
                found |= {f"{column}_{key}": each for key, each in inner}
            elif not field.exclude and not isinstance(value, tuple | dict):
                found[column] = value
        return found


def _with_units(value: Any, plain: Any, units: Quantities) -> Any:
    """Return the JSON form of a value with its fields named after what was measured.

    Args:
        value: an item, or several of them.
        plain: its JSON form.
        units: names and units of what was measured.
    """
    if isinstance(value, Item):
        names = {_json_name(name): name for name in type(value).model_fields}
        held = {key: getattr(value, str(names.get(key, key))) for key in plain}
        return {units.key(k): _with_units(held[k], plain[k], units) for k in plain}
    if isinstance(value, Mapping):
        return {k: _with_units(each, plain[k], units) for k, each in value.items()}
    if isinstance(value, tuple):
        return [
            _with_units(each, item, units)
            for each, item in zip(value, plain, strict=True)
        ]
    return plain


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


class Result(Item):
    """The answer to a question.

    A subclass declares the field `format`, which holds name and version of its JSON
    format as a `Literal` with a default, and which JSON calls `schema`.

    Attributes:
        template: address of the Markdown template inside the package.
        table: name of the attribute that holds the main table: items, or items by name.
        reasons: why the result must not be used; empty if it may be.
        part: the word for what was measured.
        units: names and units of what was measured.
    """

    model_config = ConfigDict(json_schema_extra={"allOf": [_RULE]})
    template: ClassVar[str]
    table: ClassVar[str]

    reasons: tuple[Words, ...] = ()
    part: Literal["gear", "part"] = Field(default="gear", exclude=True)
    units: InstanceOf[Quantities] = Field(default=FORCE, exclude=True)

    @computed_field
    @property
    def status(self) -> Literal["ok", "failed"]:
        """Whether the result may be used."""
        return "failed" if self.reasons else "ok"

    @computed_field
    @property
    def headline(self) -> Words:
        """The answer in one sentence, or why there is none."""
        if self.reasons:
            why = "; ".join(self.reasons)
            return f"This result failed its checks and must not be used: {why}."
        return self.line("headline")

    @computed_field
    @property
    def next_step(self) -> Words | None:
        """What to do next in one sentence."""
        return self.line("next_step") or None

    def block(
        self,
        name: str,
        command: str = "",
        *,
        plain: bool = False,
        on_page: bool = False,
    ) -> str:
        """Return a block of the template in Markdown; empty if there is none.

        Args:
            name: of the block.
            command: the command line that made the result.
            plain: without the escapes of Markdown.
            on_page: whether it is for the page, which folds sections away.
        """
        values = {
            "result": self,
            "part": self.part,
            "units": self.units,
            "command": command,
            "on_page": on_page,
        }
        return rendered(self.template, name, values, plain=plain)

    def line(self, name: str) -> str:
        """Return a block of the template as one line of plain text."""
        return " ".join(self.block(name, plain=True).split())

    def lines(self, name: str) -> tuple[str, ...]:
        """Return a block of the template as plain text, each line a sentence."""
        found = map(str.strip, self.block(name, plain=True).splitlines())
        return tuple(filter(None, found))

    def to_dict(self) -> dict[str, Any]:
        """Return the result as a JSON-compatible dict."""
        found = _with_units(self, json.loads(self.model_dump_json()), self.units)
        return {name: found.pop(name) for name in _FIRST} | found

    def to_json(self) -> str:
        """Return the text of a JSON file."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n"

    @classmethod
    def json_schema(cls, units: Quantities = FORCE) -> dict[str, Any]:
        """Return the JSON Schema of what `to_json` returns.

        Args:
            units: names and units of what was measured.
        """
        found = cls.model_json_schema(
            mode="serialization", schema_generator=ResultSchema
        )
        return {"$schema": DIALECT, **schema_with_units(found, units)}

    def to_frame(self) -> "pd.DataFrame":
        """Return the main table; columns without any value are left out."""
        import pandas as pd

        table = getattr(self, self.table)
        rows = (
            [{"name": name} | row.columns() for name, row in table.items()]
            if isinstance(table, Mapping)
            else [row.columns() for row in table]
        )
        names = dict.fromkeys(name for row in rows for name in row)
        kept = [n for n in names if any(row.get(n) is not None for row in rows)]
        return pd.DataFrame(rows, columns=kept).rename(columns=self.units.key)

    def to_datatree(self) -> "xr.DataTree":
        """Return the main table as xarray's DataTree, over the dimension `row`."""
        import xarray as xr

        return xr.DataTree(self.to_frame().rename_axis("row").to_xarray())

    def make_charts(self) -> Mapping[str, Chart]:
        """Return the charts by the names under which the template shows them."""
        return {}

    def charts(self) -> dict[str, Chart]:
        """Return the charts by name, marked if the result must not be used."""
        failed = bool(self.reasons)
        made = self.make_charts().items()
        return {name: replace(chart, failed=failed) for name, chart in made}

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw the first panel of the first chart.

        Args:
            ax: where; by default new axes of pyplot.

        Raises:
            NotImplementedError: the result has no chart.
        """
        from hdcal.report.chart_drawing import axes_or_new, draw_panel

        for chart in self.charts().values():
            axes = draw_panel(chart.panels[0], axes_or_new(ax))
            if chart.failed:
                axes.set_title("FAILED, do not use", color=RED)
            return axes
        raise NotImplementedError(f"a {type(self).__name__} has no chart")

    def text(self, width: int = 110) -> str:
        """Return the result as a terminal shows it."""
        from hdcal.report.terminal_text import plain_text

        return plain_text(self, width)

    def page(self, command: str = "") -> str:
        """Return the result as an HTML page that needs no other file.

        Args:
            command: the command line that made the result.
        """
        from hdcal.report.page import html_page

        return html_page(self, command)

    def _repr_html_(self) -> str:
        from hdcal.report.page import notebook_html

        return notebook_html(self)

    def __repr__(self) -> str:
        said = "FAILED, do not use" if self.reasons else self.headline
        return f"<{type(self).__name__}: {said}>"

    __str__ = __repr__
