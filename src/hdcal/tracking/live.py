"""The stiffness of a stream as a picture that follows it, in a terminal."""

import time
from typing import Any, TextIO

import numpy as np

from hdcal.report.braille import scatter_lines

# Readings that are shown, and seconds from one picture to the next.
_SHOWN, _PAUSE = 2000, 0.25
_UP, _REST = "\x1b[{}A", "\x1b[J"


class LivePicture:
    """Draws the stiffness over the readings, with the ends of its interval.

    Args:
        sink: where to.
        live: whether it is a terminal that shows nothing else; else there is one
            picture, at the end.
    """

    def __init__(self, sink: TextIO, *, live: bool):
        self._sink, self._live = sink, live
        self._rows: list[tuple[float, ...]] = []
        self._alarms = 0
        self._lines, self._next = 0, 0.0

    def take(self, answer: dict[str, Any]) -> None:
        """Take the answer to one reading; those that are no reading are left out."""
        if answer["status"] != "ok":
            return
        found = answer["stiffness_N_per_mm"]
        if found["credible_95"] is None:
            return
        self._rows.append((answer["row"], found["mean"], *found["credible_95"]))
        del self._rows[:-_SHOWN]
        self._alarms += bool(answer["alarm"])
        if self._live and time.monotonic() >= self._next:
            self.draw()
            self._next = time.monotonic() + _PAUSE

    def draw(self) -> None:
        """Draw it, in the place of the last one."""
        rows = np.array([row for row in self._rows if np.isfinite(row).all()])
        if not len(rows):
            return
        at, level = np.repeat(rows[:, 0], 3), rows[:, 1:].ravel()
        heading = f"stiffness [N/mm], 95 %; readings with alarm: {self._alarms}"
        labels = "reading", heading
        lines = scatter_lines(at, level, labels)
        if self._lines:
            self._sink.write(_UP.format(self._lines) + _REST)
        self._sink.write("\n".join(lines) + "\n")
        self._sink.flush()
        self._lines = len(lines) if self._live else 0
