"""Results that describe themselves: JSON, schema, table, chart and text follow.

A question declares its result as a subclass of `Result`. Labels and units stand in the
fields, sentences in the template of the question.
"""

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import ConfigDict, Field, InstanceOf, computed_field

from hdcal.quantities import FORCE, Quantities
from hdcal.report.charts.chart_spec import RED, Chart
from hdcal.report.item import Item, Words, with_units
from hdcal.report.result_schema import DIALECT, ResultSchema, schema_with_units
from hdcal.report.sentences import rendered

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes

_FIRST = ("schema", "status", "reasons", "headline", "next_step")
# A failed result has reasons, any other result has none.
_RULE = {
    "if": {"properties": {"status": {"const": "failed"}}},
    "then": {"properties": {"reasons": {"minItems": 1}}},
    "else": {"properties": {"reasons": {"maxItems": 0}}},
}


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
        found = with_units(self, json.loads(self.model_dump_json()), self.units)
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
        from hdcal.report.charts.chart_drawing import axes_or_new, draw_panel

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
