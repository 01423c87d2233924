"""What is asked of a response: the force, the times, what is given beforehand."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hdcal.data.plausible import implausible
from hdcal.errors import Finding, InputError
from hdcal.physics.forcing import Chirp, Forcing, SampledForce, Step

SHAPES = ("step", "sine", "chirp")
# Time and force of a sampled force, [s] and [N], or the name of a shape.
Drive = str | tuple[Sequence[float] | np.ndarray, Sequence[float] | np.ndarray]
_DURATION = 0.5


@dataclass(frozen=True)
class Request:
    """A checked question.

    Attributes:
        force: over time.
        words: the force for people.
        times: at which to answer [s], shape (n,).
    """

    force: Forcing
    words: str
    times: np.ndarray


def make_request(
    drive: Drive,
    amplitude: float,
    frequency: float | Sequence[float] | None,
    duration: float | None,
    points: int,
) -> Request:
    """Check a question and bring it into one form.

    Args:
        drive: step, sine, chirp, or time and force of a sampled one.
        amplitude: of a named shape [N].
        frequency: of a sine, or first and last of a chirp [Hz].
        duration: of a named shape [s].
        points: number of times to answer at.

    Raises:
        InputError: with everything that is wrong.
    """
    findings: list[Finding] = []

    def find(name: str, problem: str, remedy: str) -> None:
        findings.append(Finding(name, problem, remedy))

    findings += implausible("points", points) + implausible("amplitude", amplitude)
    findings += (wrong := implausible("duration", duration))
    if isinstance(drive, str) and drive not in SHAPES:
        known = ", ".join(SHAPES)
        find("force", f"'{drive}' is no known force", f"Use {known} or a table")
    if amplitude == 0.0:
        find("amplitude", "0 drives nothing", "Give a force in N")
    if not isinstance(drive, str) and duration is not None:
        find("duration", "a sampled force has its own", "Leave it out")
    length = _DURATION if wrong or duration is None else duration
    tones = _tones(drive, frequency, length, points, find)
    if not isinstance(drive, str):
        _check_table(drive, find)
    if findings:
        raise InputError(findings)
    return _request(drive, amplitude, tones, length, points)


def _request(
    drive: Drive, amplitude: float, tones: list[float], length: float, points: int
) -> Request:
    if not isinstance(drive, str):
        time, force = (np.asarray(part, dtype=float) for part in drive)
        words = f"a sampled force of {len(time)} rows, linear between them"
        return Request(
            SampledForce(time, force), words, np.linspace(time[0], time[-1], points)
        )
    times = np.linspace(0.0, length, points)
    if drive == "step":
        return Request(Step(amplitude), f"a step of {amplitude:g} N", times)
    if drive == "sine":
        words = f"a sine of {amplitude:g} N at {tones[0]:g} Hz"
    else:
        words = f"a sweep of {amplitude:g} N from {tones[0]:g} to {tones[1]:g} Hz"
    return Request(Chirp(amplitude, tones[0], tones[-1], length), words, times)


def _tones(drive, frequency, duration: float, points: int, find) -> list[float]:
    """Check the frequencies of a shape and return them [Hz]."""
    need = {"sine": 1, "chirp": 2}.get(drive, 0) if isinstance(drive, str) else 0
    given = [] if frequency is None else [float(f) for f in np.ravel(frequency)]
    if len(given) != need:
        words, remedy = {
            0: ("such a force has no frequency", "Leave it out"),
            1: ("a sine needs one frequency", "Give it in Hz, such as 5"),
            2: (
                "a chirp needs its first and last",
                "Give both in Hz",
            ),
        }[need]
        find("frequency", words, remedy)
        return []
    highest = 0.5 * (points - 1) / duration
    for tone in given:
        lowest = tone == 0.0 and need == 2
        if wrong := implausible("frequency", tone):
            find("frequency", wrong[0].problem, wrong[0].remedy)
        elif tone == 0.0 and not lowest:
            find("frequency", "0 Hz is not positive", "Give it in hertz")
        elif tone > highest:
            words = f"{tone:g} Hz cannot be seen at {points} points in {duration:g} s"
            remedy = f"Stay below {highest:g} Hz, or use more points"
            find("frequency", words, remedy)
    if need == 2 and given[0] == given[1]:
        find("frequency", "a chirp between equal frequencies is a sine", "Use sine")
    return given


def _check_table(drive, find) -> None:
    time, force = (np.asarray(part, dtype=float) for part in drive)
    if time.shape != force.shape or time.ndim != 1 or len(time) < 2:
        find("force", "needs as many times as forces, two or more", "Mend the table")
    elif wrong := implausible("force", force) + implausible("force", time, "time"):
        find("force", f"the table holds {wrong[0].problem}", "Mend the table")
    elif np.any(np.diff(time) <= 0.0):
        find("force", "has times that do not rise", "Put them in order")
    elif not np.any(force):
        find("force", "is zero throughout", "Give a force in N")
