"""How a result shows itself in a notebook: in words, as a table, as a drawing.

What tells of a class stands in its own room; here are names only, so that nothing loads
before it is asked for.
"""

from importlib import import_module
from typing import Any

# Class -> what makes a `report.result.Result` of it.
RESULTS = {
    "DynamicPosterior": "motion.dynamic_result.dynamic_calibration_of",
    "Posterior": "calibration.calibration.calibration_of",
    "Residuals": "calibration.residual_report.residual_report",
}
# Class of another result -> who tells of it.
TELLERS = {
    "Fleet": "fleets.summary.fleet_report",
    "NextForce": "fleets.force.document.force_document",
}
# -> what its table is made of: rows, or columns by name.
TABLES = {
    "Fleet": "fleets.summary.gear_table",
    "NextForce": "fleets.force.chart.bound_rows",
    "Study": "report.tables.own_columns",
}
# -> its chart.
CHARTS = {
    "Fleet": "fleets.chart.fleet_chart",
    "NextForce": "fleets.force.chart.force_chart",
}


class Shown:
    """A result that shows what matters most of it in a notebook's cell."""

    def __repr__(self) -> str:
        result = self._result
        shown = result or self._document
        failed = result.reasons if result else shown.failed
        said = "FAILED, do not use" if failed else shown.headline
        return f"<{type(self).__name__}: {said}>"

    def _repr_html_(self) -> str:
        if (result := self._result) is not None:
            return result._repr_html_()
        return import_module("hdcal.report.html").notebook_html(self._document)

    @property
    def _result(self) -> Any:
        """The result of a class that has one; else None."""
        address = RESULTS.get(type(self).__name__)
        return None if address is None else _room(address)(self)

    @property
    def _document(self) -> Any:
        told = self._ask(TELLERS)
        return getattr(told, "document", told)

    def to_frame(self) -> Any:
        """Return its main table as pandas' DataFrame.

        It holds parameters, rows, levels, hypotheses or designs.
        """
        if (result := self._result) is not None:
            return result.to_frame()
        import pandas as pd

        return pd.DataFrame({name: [*each] for name, each in self._columns.items()})

    def to_datatree(self) -> Any:
        """Return its main table as xarray's DataTree; draws are in ArviZ' groups."""
        if (tree := getattr(self, "tree", None)) is not None:
            return tree
        if (result := self._result) is not None:
            return result.to_datatree()
        return import_module("hdcal.report.tables").datatree(self._columns)

    def plot(self, ax: Any = None) -> Any:
        """Draw it with matplotlib.

        Args:
            ax: Axes where to; by default new axes of pyplot's.

        Returns:
            These Axes.
        """
        if (result := self._result) is not None:
            return result.plot(ax)
        drawer = import_module("hdcal.report.chart_figure")
        return drawer.draw_chart(self._ask(CHARTS), ax)

    @property
    def _columns(self) -> dict[str, list]:
        return import_module("hdcal.report.tables").as_columns(self._ask(TABLES))

    def _ask(self, table: dict[str, str]) -> Any:
        """Return what the room of this class has to say of it.

        Raises:
            NotImplementedError: it has nothing of the kind.
        """
        known = [kind.__name__ for kind in type(self).__mro__]
        # A moving gear is no gear at rest: what is said of that one is not inherited.
        known = known[:1] if known[0] in TELLERS else known
        name = next((name for name in known if name in table), None)
        if name is None:
            raise NotImplementedError(f"of a {known[0]} there is no such drawing")
        return _room(table[name])(self)


def _room(address: str) -> Any:
    """Return the function of this address."""
    room, _, asked = f"hdcal.{address}".rpartition(".")
    return getattr(import_module(room), asked)
