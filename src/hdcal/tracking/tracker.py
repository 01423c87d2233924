"""Follow a gear reading by reading: stiffness, the next force, and a change alarm."""

from collections.abc import Sequence
from math import inf, sqrt
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, StrictFloat
from scipy.special import stdtrit

from hdcal.data.plausible import implausible, range_of
from hdcal.errors import InputError
from hdcal.prediction.conditions import NEAR_K, NEAR_MM
from hdcal.prediction.models import Models
from hdcal.tracking.bank import CELL, FIELDS, follow_rows
from hdcal.tracking.change_alarm import threshold_for
from hdcal.tracking.draw_forces import draws_of, first_bank

SCHEMA = "hdcal.track/1"
# Rows that one compiled program takes, beside a single one.
_BLOCK = 1024
# Below this effective number of draws their spread is no posterior's.
_LEAST_DRAWS = 5.0
# How far beyond the data still counts as tested [mm, K].
_SLACK = np.array([NEAR_MM, NEAR_K])


def _number(name: str, **more: Any) -> Any:
    """Return a field of a reading with its plausible range."""
    return Field(ge=range_of(name).low, le=range_of(name).high, **more)


class StreamReading(BaseModel):
    """Deformation [mm] and force [N] as read, and the temperature of the specimen [°C].

    Without a temperature it is the reference temperature. With another label of the
    run, the mounting, the zero may have moved.
    """

    model_config = ConfigDict(
        allow_inf_nan=False, coerce_numbers_to_str=True, extra="forbid"
    )

    deformation: StrictFloat = _number("deformation")
    force: StrictFloat = _number("force")
    temperature: StrictFloat | None = _number("temperature", default=None)
    run: str | None = None


class Tracker:
    """Update the stiffness with every reading, and raise an alarm at a change.

    Memory does not grow with the rows.

    Args:
        known: a calibration, or several with probabilities.
        alarm_rows: mean number of readings between false alarms, 10 to 10⁹.

    Attributes:
        notes: sentences on the models.
        stiffness: at the start, mean and half-width of its 95 % interval [N/mm].
        rows, readings, alarms: numbers of rows, of readings among them, and of alarms.

    Raises:
        NotUsable: the calibration failed its checks.
        InputError: it holds what cannot be followed row by row, or an argument is out
            of range.
    """

    def __init__(self, known: Models, *, alarm_rows: float = 10_000.0):
        if wrong := implausible("alarm_rows", alarm_rows):
            raise InputError(wrong)
        every, self.notes = draws_of(known)
        self._draws, self._bank = first_bank(every, threshold_for(alarm_rows))
        case = every.model.posterior.case
        self.units, rows = case.units, case.records
        self._keys = self.units.key("stiffness_N_per_mm"), self.units.key("force_N")
        self._reference = case.gear.reference_temperature
        tested = np.stack([rows.deformation, rows.temperature])
        self._low = np.min(tested, axis=1) - _SLACK
        self._high = np.max(tested, axis=1) + _SLACK
        mean, scale = map(float, self._bank.stiffness_now)
        self.stiffness = mean, scale * float(stdtrit(2.0 * self._bank.shape, 0.975))
        self._alarm_rows, self._since = alarm_rows, 1
        self._follows, self._run = False, None
        self.rows = self.readings = self.alarms = 0

    def update(self, deformation: float, force: float, **more) -> dict[str, Any]:
        """Take one reading of `StreamReading`; return a line of `hdcal track`.

        Raises:
            ValueError: a number is missing or implausible; nothing was learned.
        """
        reading = StreamReading(deformation=deformation, force=force, **more)
        return self.follow([reading])[0]

    def follow(self, readings: Sequence[StreamReading | str]) -> list[dict[str, Any]]:
        """Take readings in their order, or why a line is none; return as `update`."""
        answers, good, rows = [], [], []
        for reading in readings:
            self.rows += 1
            answers.append({"schema": SCHEMA, "status": "error", "row": self.rows})
            if isinstance(reading, str):
                answers[-1]["error"], self._follows = reading, False
            else:
                good.append(answers[-1])
                rows.append(self._as_row(reading))
        for first in range(0, len(rows), _BLOCK):
            block = slice(first, first + _BLOCK)
            lines = self._fields(np.array(rows[block]))
            for answer, line in zip(good[block], lines, strict=True):
                self._fill(answer, line)
        return answers

    def _as_row(self, reading: StreamReading) -> tuple[float, ...]:
        """Return deformation, temperature, force, and flags: follows, remounted."""
        remounted = None is not self._run != reading.run is not None
        self._run = self._run if reading.run is None else reading.run
        follows, self._follows = self._follows and not remounted, True
        warm = reading.temperature
        warm = self._reference if warm is None else warm
        return reading.deformation, warm, reading.force, follows, remounted

    def _fields(self, rows: np.ndarray) -> list[dict[str, float]]:
        """Return FIELDS, half-width of an interval in scales, and tested, of rows."""
        count = len(rows)
        where = rows[:, :2]
        tested = np.all((self._low <= where) & (where <= self._high), axis=1)
        padded = np.zeros((1 if count == 1 else _BLOCK, rows.shape[1]))
        padded[:count] = rows
        at, warm, force, follows, remounted = padded.T
        forces = self._draws.at(at, warm)
        width = CELL * float(self._bank.step) or inf
        cell = np.round(np.asarray(forces.mean).mean(axis=1) / width).astype(int)
        inputs = {"force": force, "forces": forces, "cell": cell}
        inputs |= {"follows": follows > 0.0, "remounted": remounted > 0.0}
        self._bank, lines = follow_rows(self._bank, inputs, count)
        lines = np.asarray(lines)[:count]
        half = stdtrit(lines[:, FIELDS.index("freedom")], 0.975)
        names, lines = (*FIELDS, "half", "tested"), np.c_[lines, half, tested]
        return [dict(zip(names, line, strict=True)) for line in lines.tolist()]

    def _fill(self, answer: dict[str, Any], line: dict[str, float]) -> None:
        """Complete the answer to a reading."""
        force, spread = line["force"], line["half"] * line["force_scale"]
        mean, scale = line["stiffness"], line["stiffness_scale"]
        half, freedom = line["half"] * scale, line["freedom"]
        stiffness = {
            "mean": mean,
            "sd": scale * sqrt(freedom / (freedom - 2.0)),
            "credible_95": [mean - half, mean + half],
            "narrowed": 1.0 - half / self.stiffness[1],
        }
        band, alarm = [force - spread, force + spread], bool(line["alarm"])
        answer |= {
            "status": "ok",
            self._keys[0]: stiffness,
            self._keys[1]: {"predicted": force, "predictive_95": band},
            "innovation": line["innovation"],
            "alarm": alarm,
            "alarm_score": line["score"],
            "alarm_since_row": self._since,
            "false_alarm_rows": self._alarm_rows,
            "correlation": line["correlation"],
            "tested": bool(line["tested"]),
        }
        if any(effect.stage != "noise" for effect in self._draws.model.effects):
            few = line["draws"] < _LEAST_DRAWS
            answer |= {"effective_particles": line["draws"], "degenerate": few}
            if few:
                stiffness |= dict.fromkeys(("sd", "credible_95", "narrowed"))
        self.readings += 1
        self.alarms += alarm
        self._since = answer["row"] + 1 if alarm else self._since
