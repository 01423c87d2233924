"""The force over time that a response is asked for, and its checks."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from hdcal.data.plausible import implausible
from hdcal.errors import Finding, Findings
from hdcal.physics.forcing import Chirp, Forcing, SampledForce, Step

# Number of frequencies of each shape.
SHAPES = {"step": 0, "sine": 1, "chirp": 2}
# A shape, or times [s] and forces [N].
Force = str | tuple[Sequence[float] | np.ndarray, Sequence[float] | np.ndarray]
_DURATION = 0.5


class Drive(NamedTuple):
    """A checked request: the force, and the times of the answer [s]."""

    force: Forcing
    times: np.ndarray


def make_drive(
    force: Force,
    amplitude: float,
    frequency: float | Sequence[float] | None,
    duration: float | None,
    points: int,
) -> Drive:
    """Return a checked request; arguments are those of `respond`.

    Raises:
        InputError: with everything that is wrong.
    """
    tones = [] if frequency is None else [float(f) for f in np.ravel(frequency)]
    length = _DURATION if duration is None else duration
    with Findings() as wrong:
        wrong += implausible("points", points) + implausible("amplitude", amplitude)
        wrong += implausible("duration", duration) + implausible("frequency", tones)
        if not isinstance(force, str):
            wrong += _table_findings(*(np.asarray(part, float) for part in force))
            if duration is not None or tones:
                words = "a sampled force has its own duration and frequency"
                wrong.append(Finding("duration", words, "Leave both out"))
        elif not wrong:
            wrong += _shape_findings(force, amplitude, tones, (points - 1) / length)
    if not isinstance(force, str):
        time, values = (np.asarray(part, float) for part in force)
        return Drive(SampledForce(time, values), np.linspace(time[0], time[-1], points))
    times = np.linspace(0.0, length, points)
    if not tones:
        return Drive(Step(amplitude), times)
    return Drive(Chirp(amplitude, tones[0], tones[-1], length), times)


def _shape_findings(
    shape: str, amplitude: float, tones: list[float], per_second: float
) -> Iterator[Finding]:
    if amplitude == 0.0:
        yield Finding("amplitude", "0 drives nothing", "Give a force in N")
    if shape not in SHAPES:
        words = f"'{shape}' is not a known force"
        yield Finding("force", words, f"Use {', '.join(SHAPES)} or a table")
    elif len(tones) != SHAPES[shape]:
        words = f"a {shape} takes {SHAPES[shape]} frequencies, not {len(tones)}"
        yield Finding("frequency", words, "Give 5 for a sine, 5:200 for a chirp")
    elif tones == [0.0]:
        yield Finding("frequency", "0 Hz is not positive", "Give it in hertz")
    elif max(tones, default=0.0) > 0.5 * per_second:
        words = f"{per_second:g} points per second do not resolve {max(tones):g} Hz"
        yield Finding("frequency", words, "Use more points, or a shorter duration")


def _table_findings(time: np.ndarray, force: np.ndarray) -> Iterator[Finding]:
    if time.shape != force.shape or time.ndim != 1 or len(time) < 2:
        words = "needs as many times as forces, two or more"
        yield Finding("force", words, "Correct the table")
    elif wrong := implausible("force", force) + implausible("force", time, "time"):
        words = f"the table holds {wrong[0].problem}"
        yield Finding("force", words, "Correct the table")
    elif np.any(np.diff(time) <= 0.0):
        yield Finding("force", "has times that do not rise", "Put them in order")
    elif not np.any(force):
        yield Finding("force", "is zero throughout", "Give a force in N")
