"""Patterns that readings show whatever their cause: contrasts beyond the noise.

The clearest contrast is taken first and joins the base model; the others are then
tested on what it leaves, at a family-wise error of 1 % in all. The size of a contrast
is its swing from the lowest to the highest place.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jax import jit
from scipy.special import ndtri

from hdcal.data.case import Case
from hdcal.data.loading import loading_side
from hdcal.data.prior import Prior
from hdcal.data.records import Records, less_run_means
from hdcal.diagnosis.which import MATTERS
from hdcal.evidence.base_model import moments
from hdcal.evidence.linear_problem import LinearProblem, padded_records
from hdcal.inference.force_model.noise_form import loop_cells
from hdcal.inference.force_model.residual_shapes import (
    Correlated,
    ResidualFinding,
    Whitened,
    find_structure,
)
from hdcal.inference.force_model.serial_correlation import CORRELATION
from hdcal.physics.history import load_cycle
from hdcal.report.item import INTERVAL, Interval, Item, Probability, Words
from hdcal.report.words import load

# Ends of the curve, as shares of the largest deformation.
_TOE, _HEAD = 0.25, 0.75
# Shares of the range over which a gradual loop changes over.
_REACHES = np.array([0.03, 0.1, 0.3])
# Of more runs or gears than these none is a contrast.
_MOST_MEMBERS = 24
# Prior sd of the loss of modulus [1/K] that no stated material has.
_ANY_MATERIAL = 1e-3
# Correlation of neighbouring readings where the gear file states none: most rigs read
# independently, loggers with filters do not.
_CORRELATION = Prior("beta", (0.5, 1.5))
# Column of the base model: stiffness, zero of the force, loss of modulus, contact.
_MODULUS_LOSS = 2
# Swing of a column, of sizes about one, that rounding alone gives.
_NOTHING = 1e-9
_UP, _RISES = ("up", "down"), ("rises", "falls")


class Seen(Item):
    """A pattern of the readings, whatever its cause.

    The size is that from its lowest to its highest place, a simultaneous interval; the
    p-value is adjusted for all patterns tested. It is material from 0.025 % of the
    largest force on.
    """

    statement: Words
    covariate: Words
    size_N: Interval
    p_value: Probability
    material: bool


@dataclass(frozen=True)
class Contrast:
    """One pattern that readings may have, and a statement with {way} and {size}.

    `ways` are the words for a positive and a negative coefficient. The size is a share
    of the swing of the column, off a straight line over the stroke if `off_line`.
    """

    covariate: str
    column: np.ndarray
    ways: tuple[str, str]
    words: str
    off_line: bool = True
    share: float = 1.0

    def swing(self, x: np.ndarray) -> float:
        """Return the share of the distance from the lowest to the highest place."""
        column = self.column
        if self.off_line:
            column = column - np.polyval(np.polyfit(x, column, 1), x)
        return self.share * float(np.ptp(column))


def _along_the_stroke(x: np.ndarray, *, both: bool) -> Iterator[Contrast]:
    side, depth = np.sign(x) if both else np.ones_like(x), np.abs(x)
    # Through zero a curve swings to both sides; its size is that of one.
    place, share = "deformation", 0.5 if both else 1.0
    words = "the curve {way} with the {displacement}, by {size} from a straight line"
    bend = side * depth**2
    yield Contrast(place, bend, ("stiffens", "softens"), words, share=share)
    words = "at small {displacement}s the {load} is {size} too {way}"
    toe = side * np.maximum(_TOE - depth, 0.0)
    yield Contrast(place, toe, ("high", "low"), words, False, share)
    words = "at the largest {displacement}s the curve turns {way} by {size}"
    head = side * np.maximum(depth - _HEAD, 0.0)
    yield Contrast(place, head, _UP, words, False, share)


def _over_direction(
    records: Records, x: np.ndarray, *, both: bool
) -> Iterator[Contrast]:
    """Yield loops of even width, sudden or gradual, and loops that widen or narrow."""
    # A few steps back between readings are no measured unloading.
    if "unloading" not in records.known:
        return
    sense, ways = np.asarray(records.sense, float), ("lower", "higher")
    down, than = "on unloading", "on loading"
    if both:
        down, than = "while the {displacement} decreases", "while it increases"
    words = f"the {{load}} is {{size}} {{way}} {down} than {than}"
    for column in (sense, *loop_cells(records, _REACHES)):
        yield Contrast("direction", column, ways, words, False)
    words = (
        f"the {{load}} {down} is {{way}} than {than}, increasingly with the "
        f"{{displacement}}, by {{size}} over the range"
    )
    yield Contrast("direction", sense * np.abs(x), ways, words, False)


def _over_time(records: Records, x: np.ndarray) -> Iterator[Contrast]:
    # With one speed in both directions the rate is the direction.
    if "rates" in records.known:
        words = "a faster movement needs {way} {load}, by {size} over the tested speeds"
        yield Contrast("rate", np.asarray(records.rate), ("more", "less"), words)
    # A place that was read twice, as where the movement turns, was not held.
    if "holds" in records.known:
        words = "while the {displacement} is held the {load} {way} by {size}"
        yield Contrast("time", _held(records), _RISES, words)
    words = "the {load} drifts {way} by {size} within a run"
    # A clock may run on from run to run.
    clock = less_run_means(np.asarray(records.time), np.asarray(records.run))
    yield Contrast("time", clock, _UP, words)
    words = "from the first reading to the last the {load} {way} by {size}"
    yield Contrast("order", np.linspace(0.0, 1.0, len(x)), _RISES, words)
    # Whole cycles: loading and unloading may differ in slope.
    padded = padded_records(records)
    cycle = jit(load_cycle)(padded.sense, padded.run, padded.specimen)
    cycle = np.asarray(cycle)[: len(x)]
    words = "the slope {way} from cycle to cycle, which changes the {load} by {size} "
    yield Contrast("order", (cycle - cycle.mean()) * x, _RISES, words + "in total")


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
    warm, place = np.asarray(records.temperature), "temperature"
    words = "the zero {way} with temperature, by {size} over the tested range"
    yield Contrast(place, warm, _RISES, words)
    beyond = " more than the modulus" if known_alpha else ""
    words = f"the slope {{way}} with temperature{beyond}, "
    words += "which changes the {load} by {size}"
    yield Contrast(place, (warm - warm.mean()) * x, _RISES, words)


def _of_members(records: Records, case: Case, x: np.ndarray) -> Iterator[Contrast]:
    for turns, often in ((1, "once"), (2, "twice")):
        words = f"the stiffness varies with the angle, {often} per turn, "
        words += "which changes the {load} by {size}"
        for wave in (np.cos, np.sin):
            column = wave(turns * np.asarray(records.angle)) * x
            yield Contrast("angle", column, ("", ""), words)
    runs, gears = case.run_labels, case.specimen_labels
    for k in range(1, len(runs) if len(runs) <= _MOST_MEMBERS else 0):
        words = f"the zero steps {{way}} by {{size}} from run {runs[k - 1]} to "
        later = (np.asarray(records.run) >= k).astype(float)
        yield Contrast("run", later, _UP, words + runs[k], False)
    for k in range(len(gears) if 1 < len(gears) <= _MOST_MEMBERS else 0):
        words = f"gear {gears[k]} is {{way}} than the others, "
        words += "which changes its {load} by {size}"
        column = (np.asarray(records.specimen) == k) * x
        yield Contrast("specimen", column, ("stiffer", "softer"), words)


def find_patterns(problem: LinearProblem, case: Case) -> tuple[Seen, ...]:
    """Return the contrasts that noise would rarely show, the clearest first."""
    records = problem.records
    # Of a gear that is pulled the statements are about the size of its force.
    side = loading_side(np.asarray(records.deformation))
    sign, both = float(side or 1), side == 0
    turned = ("deformation", "sense", "rate")
    turned = replace(records, **{n: sign * getattr(records, n) for n in turned})
    x = np.asarray(turned.deformation) / np.max(np.abs(turned.deformation))
    known_alpha = moments(problem.priors, "alpha")[1] < _ANY_MATERIAL
    every = (
        *_along_the_stroke(x, both=both),
        *_over_direction(turned, x, both=both),
        *_over_time(turned, x),
        *_over_temperature(turned, x, known_alpha=known_alpha),
        *_of_members(turned, case, x),
    )
    tried = {str(index): each for index, each in enumerate(every)}
    swing = {name: each.swing(x) for name, each in tried.items()}
    tried = {n: each for n, each in tried.items() if swing[n] > _NOTHING}
    base = problem.X if known_alpha else np.delete(problem.X, _MODULUS_LOSS, axis=1)
    found = _found(problem, case, sign * problem.y, base, tried)
    # Of loops with the same statement the clearest counts.
    once: dict[str, ResidualFinding] = {}
    for each in found:
        contrast = tried[each.name]
        same = contrast.words if contrast.covariate == "direction" else each.name
        once.setdefault(same, each)
    quantile = float(-ndtri((1.0 - INTERVAL) / (2.0 * max(len(tried), 1))))
    return tuple(
        _seen(tried[each.name], each, swing[each.name], quantile, case)
        for each in sorted(once.values(), key=lambda each: each.p_value)
    )


def _found(
    problem: LinearProblem,
    case: Case,
    y: np.ndarray,
    base: np.ndarray,
    tried: dict[str, Contrast],
) -> tuple[ResidualFinding, ...]:
    """Search contrasts within runs first, then between runs.

    Slope and zero are free; the other columns of the base are held by their priors.
    Zeros that differ from run to run would pass for correlated noise, of which a loop
    is a part: at first each run has a free zero.
    """
    sd, held = problem.noise_sd / np.asarray(problem.weight), np.eye(base.shape[1])[2:]

    def white(columns, below: np.ndarray | float = 0.0):
        end = np.broadcast_to(below, (len(held), *columns.shape[1:]))
        return np.concatenate([(columns.T / sd).T, end])

    stated = case.gear.scale_priors[CORRELATION]
    prior = _CORRELATION if stated.family == "uniform" else stated
    noise = Correlated(problem.before, prior)
    shapes = {name: (white(each.column), "", "") for name, each in tried.items()}
    data = Whitened(white(y), white(base, held), shapes)
    run = np.asarray(problem.records.run)
    zeros = (run[:, None] == np.unique(run)).astype(float)
    if zeros.shape[1] == 1:
        return find_structure(data, sd, noise)
    free = replace(data, absorbed=np.column_stack([data.absorbed, white(zeros)]))
    within = find_structure(free, sd, noise, looks=2)
    columns = [shapes.pop(each.name)[0] for each in within]
    rest = replace(data, absorbed=np.column_stack([data.absorbed, *columns]))
    return (*within, *find_structure(rest, sd, noise, looks=2))


def _seen(
    contrast: Contrast,
    found: ResidualFinding,
    swing: float,
    quantile: float,
    case: Case,
) -> Seen:
    size, half = abs(found.coefficient) * swing, quantile * found.error * swing
    words = contrast.words.replace("{way}", contrast.ways[found.coefficient < 0.0])
    words = words.replace("{size}", load(size, case.units))
    return Seen(
        statement=case.units.say(words),
        covariate=contrast.covariate,
        size_N=Interval(median=size, lo=max(size - half, 0.0), hi=size + half),
        p_value=found.p_value,
        material=size >= MATTERS * float(np.max(np.abs(case.records.force))),
    )
