"""Contrasts of readings: simple patterns, each a column and the words for it."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Case
from hdcal.data.records import Records
from hdcal.evidence.effect_curves import padded_records
from hdcal.exported import jit
from hdcal.inference.force_model.noise_form import loop_cells
from hdcal.physics.history import load_cycle

# Ends of the curve, as shares of the largest deformation.
_TOE, _HEAD = 0.25, 0.75
# Shares of the range over which a gradual loop changes over.
_REACHES = np.array([0.03, 0.1, 0.3])
# Of more runs or gears than these none is a contrast.
_MOST_MEMBERS = 24


@dataclass(frozen=True)
class Contrast:
    """One pattern that readings may have.

    Attributes:
        covariate: on which it depends.
        column: its shape, shape (n,).
        ways: the words for {way} where the coefficient is positive, and negative.
        words: a statement with {way} and {size}, to be formatted.
        off_line: whether its size is the swing off a straight line over x.
        share: of the swing that is its size.
    """

    covariate: str
    column: np.ndarray
    ways: tuple[str, str]
    words: str
    off_line: bool = False
    share: float = 1.0

    def swing(self, x: np.ndarray) -> float:
        """Return the difference of the highest and the lowest place of the column."""
        column = self.column
        if self.off_line:
            column = column - np.polyval(np.polyfit(x, column, 1), x)
        return self.share * float(np.ptp(column))


def contrasts(
    records: Records, case: Case, *, both: bool, known_alpha: bool
) -> Iterator[Contrast]:
    """Yield the patterns that records may have.

    Args:
        records: of which the force has the sign of the deformation.
        case: for labels.
        both: whether there is compression and tension.
        known_alpha: whether the material's loss of modulus with temperature is known.
    """
    deformation = np.asarray(records.deformation)
    x = deformation / np.max(np.abs(deformation))
    yield from _along_the_stroke(x, both=both)
    yield from _over_direction(records, x, both=both)
    yield from _over_time(records, x)
    yield from _over_temperature(records, x, known_alpha=known_alpha)
    yield from _of_members(records, case, x)


def _along_the_stroke(x: np.ndarray, *, both: bool) -> Iterator[Contrast]:
    side, depth = np.sign(x) if both else np.ones_like(x), np.abs(x)
    # Through zero a curve swings to both sides; its size is that of one.
    share = 0.5 if both else 1.0
    yield Contrast(
        "deformation",
        side * depth**2,
        ("stiffens", "softens"),
        "the curve {way} with the {{displacement}}, {size} off a straight line",
        off_line=True,
        share=share,
    )
    yield Contrast(
        "deformation",
        side * np.maximum(_TOE - depth, 0.0),
        ("high", "low"),
        "at small {{displacement}}s the {{load}} lies {size} too {way}",
        share=share,
    )
    yield Contrast(
        "deformation",
        side * np.maximum(depth - _HEAD, 0.0),
        ("up", "down"),
        "at the largest {{displacement}}s the {{load}} turns {way} by {size}",
        share=share,
    )


def _over_direction(
    records: Records, x: np.ndarray, *, both: bool
) -> Iterator[Contrast]:
    """Yield loops of even width, sudden or gradual, and loops that widen or narrow."""
    sense = np.asarray(records.sense, float)
    down, up = "unloading", "loading"
    while_down, while_up = f"on {down}", f"on {up}"
    if both:
        down, up = "decreasing {{displacement}}", "increasing"
        while_down = "while the {{displacement}} decreases"
        while_up = "while it increases"
    words = f"the {{{{load}}}} lies {{size}} {{way}} {while_down} than {while_up}"
    cells = loop_cells(records, _REACHES) if "unloading" in records.known else []
    for column in (sense, *cells):
        yield Contrast("direction", column, ("lower", "higher"), words)
    words = (
        f"the larger the {{{{displacement}}}}, the {{way}} {down} lies against {up}, "
        "by {size} over the range"
    )
    yield Contrast("direction", sense * np.abs(x), ("lower", "higher"), words)


def _over_time(records: Records, x: np.ndarray) -> Iterator[Contrast]:
    # With one speed in both directions the rate is the direction.
    if "rates" in records.known:
        yield Contrast(
            "rate",
            np.asarray(records.rate),
            ("more", "less"),
            "a faster movement takes {way} {{load}}, by {size} over the speeds tested",
            off_line=True,
        )
    # A place that was read twice, as where the movement turns, was not held.
    if "holds" in records.known:
        yield Contrast(
            "time",
            _held(records),
            ("rises", "falls"),
            "while the {{displacement}} is held the {{load}} {way} by {size}",
            off_line=True,
        )
    yield Contrast(
        "time",
        np.asarray(records.time),
        ("up", "down"),
        "the {{load}} drifts {way} by {size} within a run",
        off_line=True,
    )
    yield Contrast(
        "order",
        np.linspace(0.0, 1.0, len(x)),
        ("rises", "falls"),
        "from the first reading to the last the {{load}} {way} by {size}",
        off_line=True,
    )
    # Whole cycles: loading and unloading may differ in slope.
    cycle = np.asarray(_load_cycle(padded_records(records)))[: len(x)]
    yield Contrast(
        "order",
        (cycle - cycle.mean()) * x,
        ("rises", "falls"),
        "the slope {way} from cycle to cycle, which moves the {{load}} by {size} in "
        "all",
        off_line=True,
    )


@jit
def _load_cycle(records: Records):
    return load_cycle(records.sense, records.run, records.specimen)


def _held(records: Records) -> np.ndarray:
    """Return for how long each row has been held [s]."""
    run, time = np.asarray(records.run), np.asarray(records.time)
    moved = np.asarray(records.direction) != 0
    new = moved | (np.diff(run, prepend=run[0] - 1) != 0)
    since = np.maximum.accumulate(np.where(new, np.arange(len(run)), 0))
    return time - time[since]


def _over_temperature(
    records: Records, x: np.ndarray, *, known_alpha: bool
) -> Iterator[Contrast]:
    warm, ways = np.asarray(records.temperature), ("rises", "falls")
    words = "the zero {way} with temperature, by {size} over the range tested"
    yield Contrast("temperature", warm, ways, words, off_line=True)
    beyond = " beyond the material's own" if known_alpha else ""
    words = (
        f"the slope {{way}} with temperature{beyond}, "
        "which moves the {{load}} by {size}"
    )
    yield Contrast("temperature", (warm - warm.mean()) * x, ways, words, off_line=True)


def _of_members(records: Records, case: Case, x: np.ndarray) -> Iterator[Contrast]:
    for turns, often in ((1, "once"), (2, "twice")):
        for wave in (np.cos, np.sin):
            yield Contrast(
                "angle",
                wave(turns * np.asarray(records.angle)) * x,
                ("goes", "goes"),
                f"the stiffness {{way}} with the angle, {often} a turn, "
                "which moves the {{load}} by {size}",
                off_line=True,
            )
    runs = [*map(_literally, case.run_labels)]
    gears = [*map(_literally, case.specimen_labels)]
    for k in range(1, len(runs) if len(runs) <= _MOST_MEMBERS else 0):
        yield Contrast(
            "run",
            (np.asarray(records.run) >= k).astype(float),
            ("up", "down"),
            f"the zero steps {{way}} by {{size}} from run {runs[k - 1]} to {runs[k]}",
        )
    for k in range(len(gears) if 1 < len(gears) <= _MOST_MEMBERS else 0):
        yield Contrast(
            "specimen",
            (np.asarray(records.specimen) == k) * x,
            ("stiffer", "softer"),
            f"gear {gears[k]} is {{way}} than the others, "
            "which moves its {{load}} by {size}",
            off_line=True,
        )


def _literally(label: str) -> str:
    """Return a label that formatting leaves unchanged."""
    return label.replace("{", "{{").replace("}", "}}")
