"""Results that describe themselves: JSON, schema, table, chart and text follow.

A question declares its result as a subclass of `Result`: labels and units are in the
fields, sentences in the template.
"""

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import ConfigDict, Field, InstanceOf, computed_field
from pydantic.json_schema import GenerateJsonSchema

from hdcal.quantities import FORCE, Quantities
from hdcal.report.charts.chart_spec import RED, Chart
from hdcal.report.item import Item, Words, with_units
from hdcal.report.sentences import rendered

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes

_FIRST = ("schema", "status", "reasons", "headline", "next_step")
_DIALECT = "https://json-schema.org/draft/2020-12/schema"
# A failed result has reasons, any other result has none.
_RULE = {
    "if": {"properties": {"status": {"const": "failed"}}},
    "then": {"properties": {"reasons": {"minItems": 1}}},
    "else": {"properties": {"reasons": {"maxItems": 0}}},
}


class Result(Item):
    """The answer to a question, or the reasons why it must not be used.

    A subclass declares the field `format`, called `schema` in the JSON: a `Literal`
    with name and version of the format as its default.
    """

    model_config = ConfigDict(json_schema_extra={"allOf": [_RULE]})
    # Path of the Markdown template inside the package.
    template: ClassVar[str]
    # Name of the attribute with the main table: items, or items by name.
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

        A plain one has no escapes of Markdown.
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
        """Return a block of the template as plain text, one sentence a line."""
        lines = map(str.strip, self.block(name, plain=True).splitlines())
        return tuple(filter(None, lines))

    def to_dict(self) -> dict[str, Any]:
        """Return the result as a JSON-compatible dict."""
        fields = with_units(self, json.loads(self.model_dump_json()), self.units)
        return {name: fields.pop(name) for name in _FIRST} | fields

    def to_json(self) -> str:
        """Return the result as the text of a JSON file."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n"

    @classmethod
    def json_schema(cls, units: Quantities = FORCE) -> dict[str, Any]:
        """Return the JSON Schema of `to_json` for these measured quantities."""
        found = cls.model_json_schema(mode="serialization", schema_generator=_Schema)
        return {"$schema": _DIALECT, **_schema_with_units(found, units)}

    def to_frame(self) -> "pd.DataFrame":
        """Return the main table as a DataFrame, without empty columns."""
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
        """Return the main table as a DataTree with the dimension `row`."""
        import xarray as xr

        return xr.DataTree(self.to_frame().rename_axis("row").to_xarray())

    def make_charts(self) -> Mapping[str, Chart]:
        """Return the charts by the names in the template."""
        return {}

    def charts(self) -> dict[str, Chart]:
        """Return the charts by name, marked if the result must not be used."""
        failed = bool(self.reasons)
        made = self.make_charts().items()
        return {name: replace(chart, failed=failed) for name, chart in made}

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw the first panel of the first chart, by default on axes of pyplot."""
        from hdcal.report.charts.chart_drawing import draw_panel

        for chart in self.charts().values():
            if ax is None:
                from matplotlib import pyplot

                ax = pyplot.subplots(layout="constrained")[1]
            draw_panel(chart.panels[0], ax)
            if chart.failed:
                ax.set_title("FAILED, do not use", color=RED)
            return ax
        raise NotImplementedError(f"a {type(self).__name__} has no chart")

    def text(self, width: int = 110) -> str:
        """Return the result as a terminal of this width shows it."""
        from hdcal.report.terminal_text import drawn, terminal_parts

        return drawn(terminal_parts(self), width)

    def page(self, command: str = "") -> str:
        """Return the result as an HTML page that needs no other file."""
        from hdcal.report.page import html_page

        return html_page(self, command)

    def _repr_html_(self) -> str:
        from hdcal.report.page import notebook_html

        return notebook_html(self)

    def __repr__(self) -> str:
        text = "FAILED, do not use" if self.reasons else self.headline
        return f"<{type(self).__name__}: {text}>"

    __str__ = __repr__


def _schema_with_units(schema: Any, units: Quantities) -> Any:
    """Return a schema with keys in the measured units."""
    if isinstance(schema, list):
        return [_schema_with_units(item, units) for item in schema]
    if not isinstance(schema, dict):
        return schema
    found = {key: _schema_with_units(item, units) for key, item in schema.items()}
    if isinstance(found.get("properties"), dict):
        found["properties"] = {
            units.key(name): item for name, item in found["properties"].items()
        }
        found["required"] = [*map(units.key, found.get("required", ()))]
    if isinstance(found.get("unit"), str):
        found["unit"] = units.unit(found["unit"])
    return found


class _Schema(GenerateJsonSchema):
    """JSON Schema that allows more keys, and null for floats that may be NaN."""

    def model_schema(self, schema: Any) -> dict[str, Any]:
        found = super().model_schema(schema)
        found.pop("additionalProperties", None)
        return found

    def float_schema(self, schema: Any) -> dict[str, Any]:
        found = super().float_schema(schema)
        finite = schema.get("allow_inf_nan") is False
        return found if finite else {"anyOf": [found, {"type": "null"}]}
