"""Objects that a notebook shows as their results, made when needed."""

from importlib import import_module
from typing import Any

# Class -> function that makes its `report.result.Result`, imported when needed.
RESULTS = {
    "DynamicPosterior": "motion.dynamic_calibration.dynamic_calibration_of",
    "Posterior": "calibration.calibration.calibration_of",
}


class Shown:
    """An object that is shown as its result."""

    def __repr__(self) -> str:
        result = self._result
        text = "FAILED, do not use" if result.reasons else result.headline
        return f"<{type(self).__name__}: {text}>"

    def _repr_html_(self) -> str:
        return self._result._repr_html_()

    @property
    def _result(self) -> Any:
        room, _, maker = f"hdcal.{RESULTS[type(self).__name__]}".rpartition(".")
        return getattr(import_module(room), maker)(self)

    def to_frame(self) -> Any:
        """Return the main table as a DataFrame."""
        return self._result.to_frame()

    def to_datatree(self) -> Any:
        """Return the draws in the groups of ArviZ, or the main table as a DataTree."""
        if (tree := getattr(self, "tree", None)) is not None:
            return tree
        return self._result.to_datatree()

    def plot(self, ax: Any = None) -> Any:
        """Draw the first chart on `ax`, by default on new axes of pyplot."""
        return self._result.plot(ax)
