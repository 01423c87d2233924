"""What is seen, whatever its cause: plain contrasts of the readings, one by one.

The clearest contrast is taken first and joins the base model; the others are then
tested on what it leaves, each at a family-wise error of 1 %. Its size is its swing from
the lowest to the highest place.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from hdcal.data.case import Case
from hdcal.data.loading import loading_side
from hdcal.data.records import Records
from hdcal.diagnosis.gap import Seen
from hdcal.evidence.case_evidence import CaseEvidence
from hdcal.evidence.prepare import PreparedCase
from hdcal.evidence.row_features import half_cycles
from hdcal.inference.residual_shapes import (
    Correlated,
    Structure,
    Whitened,
    find_structure,
)
from hdcal.inference.serial_correlation import CORRELATION
from hdcal.report.parameters import Interval
from hdcal.report.words import newton

# Below this share of the largest force what is seen is said to be immaterial.
_MATERIAL = 1e-3
# Ends of the curve, as shares of the largest deformation.
_TOE, _HEAD = 0.25, 0.75
# More runs or gears than these are not told one by one.
_MOST_MEMBERS = 24
# Simultaneous intervals hold with this probability.
_LEVEL = 0.9


@dataclass(frozen=True)
class Contrast:
    """One thing that readings may show.

    Attributes:
        covariate: with which it goes.
        column: how, shape (n,).
        ways: the words for {way} where the coefficient is positive, and negative.
        words: a statement with {way} and {size}.
        beside: over which it is the swing off a straight line; None for its own.
        share: of the swing that is told.
    """

    covariate: str
    column: np.ndarray
    ways: tuple[str, str]
    words: str
    beside: np.ndarray | None = None
    share: float = 1.0

    @property
    def swing(self) -> float:
        """Difference of the highest and the lowest place of the column."""
        column = self.column
        if self.beside is not None:
            column = column - np.polyval(
                np.polyfit(self.beside, column, 1), self.beside
            )
        return self.share * float(np.ptp(column))


def what_is_seen(evidence: CaseEvidence, case: Case) -> tuple[Seen, ...]:
    """Return the contrasts that noise would rarely show, the clearest first.

    Args:
        evidence: for the rows and the base model.
        case: for labels and the correlation of its noise.
    """
    prepared = evidence.prepared
    # Of a gear that is pulled, what is said is said of the size of its force.
    side = loading_side(np.asarray(prepared.records.deformation))
    sign = float(side or 1)
    every = list(_contrasts(_turned(prepared.records, sign), case, both=side == 0))
    contrasts = {str(i): c for i, c in enumerate(every) if np.ptp(c.column) > 0.0}
    sd = prepared.noise_sd / np.asarray(prepared.rows.weight)
    noise = Correlated(prepared.rows.before, case.gear.scale_priors[CORRELATION])
    found = find_structure(_whitened(prepared, contrasts, sd, sign), sd, noise)
    scale = float(np.max(np.abs(prepared.records.force)))
    quantile = float(stats.norm.isf((1.0 - _LEVEL) / (2.0 * max(len(contrasts), 1))))
    return tuple(_seen(contrasts[each.name], each, scale, quantile) for each in found)


def _turned(records: Records, sign: float) -> Records:
    turned = ("deformation", "sense", "rate")
    return replace(records, **{n: sign * getattr(records, n) for n in turned})


def _whitened(
    prepared: PreparedCase, contrasts: dict[str, Contrast], sd: np.ndarray, sign: float
) -> Whitened:
    """Bring readings, base and contrasts to noise sds; slope and zero are free."""
    base = prepared.rows.base
    width = base.shape[1]
    below = np.eye(width)[2:]
    nothing = np.zeros(width - 2)
    return Whitened(
        residual=np.concatenate([sign * prepared.rows.reading / sd, nothing]),
        absorbed=np.vstack([base / sd[:, None], below]),
        shapes={
            name: (np.concatenate([each.column / sd, nothing]), "", "")
            for name, each in contrasts.items()
        },
    )


def _seen(contrast: Contrast, found: Structure, scale: float, quantile: float) -> Seen:
    swing = abs(found.coefficient) * contrast.swing
    half = quantile * found.error * contrast.swing
    size = Interval(swing, max(swing - half, 0.0), swing + half)
    words = contrast.words.replace("{way}", contrast.ways[found.coefficient < 0.0])
    return Seen(
        statement=words.replace("{size}", newton(size.median)),
        covariate=contrast.covariate,
        size_N=size,
        p_value=found.p_value,
        material=size.median >= _MATERIAL * scale,
    )


def _contrasts(records: Records, case: Case, *, both: bool) -> Iterator[Contrast]:
    """Yield what records may show; of `both` compression and tension."""
    deformation = np.asarray(records.deformation)
    x = deformation / np.max(np.abs(deformation))
    yield from _along_the_stroke(x, both=both)
    yield Contrast(
        "direction",
        np.asarray(records.sense, float),
        ("lower", "higher"),
        "the force lies {size} {way} "
        + (
            "while the deformation decreases than while it increases"
            if both
            else "on unloading than on loading"
        ),
    )
    yield from _over_time(records, x)
    yield from _over_temperature(records, x)
    yield from _of_members(records, case, x)


def _along_the_stroke(x: np.ndarray, *, both: bool) -> Iterator[Contrast]:
    side, depth = np.sign(x) if both else np.ones_like(x), np.abs(x)
    # Through zero a curve swings to both sides; what is told is that of one.
    share = 0.5 if both else 1.0
    yield Contrast(
        "deformation",
        side * depth**2,
        ("stiffens", "softens"),
        "the curve {way} with the deformation, {size} off a straight line",
        beside=x,
        share=share,
    )
    yield Contrast(
        "deformation",
        side * np.maximum(_TOE - depth, 0.0),
        ("high", "low"),
        "at small deformations the force lies {size} too {way}",
        share=share,
    )
    yield Contrast(
        "deformation",
        side * np.maximum(depth - _HEAD, 0.0),
        ("up", "down"),
        "at the largest deformations the force turns {way} by {size}",
        share=share,
    )


def _over_time(records: Records, x: np.ndarray) -> Iterator[Contrast]:
    # Of one speed there and back, the rate tells the direction and nothing else.
    if "rates" in records.known:
        yield Contrast(
            "rate",
            np.asarray(records.rate),
            ("more", "less"),
            "a faster movement takes {way} force, by {size} over the speeds tested",
            beside=x,
        )
    # A place that was read twice, as where the movement turns, was not held.
    if "holds" in records.known:
        yield Contrast(
            "time",
            _held(records),
            ("rises", "falls"),
            "while the deformation is held the force {way} by {size}",
            beside=x,
        )
    yield Contrast(
        "time",
        np.asarray(records.time),
        ("up", "down"),
        "the force drifts {way} by {size} within a run",
        beside=x,
    )
    yield Contrast(
        "order",
        np.linspace(0.0, 1.0, len(x)),
        ("rises", "falls"),
        "from the first reading to the last the force {way} by {size}",
        beside=x,
    )
    yield Contrast(
        "order",
        half_cycles(records) * x,
        ("rises", "falls"),
        "the slope {way} from cycle to cycle, which moves the force by {size} in all",
        beside=x,
    )


def _held(records: Records) -> np.ndarray:
    """Return for how long each row has been held [s]."""
    run, time = np.asarray(records.run), np.asarray(records.time)
    moved = np.asarray(records.direction) != 0
    new = moved | (np.diff(run, prepend=run[0] - 1) != 0)
    since = np.maximum.accumulate(np.where(new, np.arange(len(run)), 0))
    return time - time[since]


def _over_temperature(records: Records, x: np.ndarray) -> Iterator[Contrast]:
    warm = np.asarray(records.temperature)
    yield Contrast(
        "temperature",
        warm,
        ("rises", "falls"),
        "the zero {way} with temperature, by {size} over the range tested",
        beside=x,
    )
    yield Contrast(
        "temperature",
        (warm - warm.mean()) * x,
        ("rises", "falls"),
        "the slope {way} with temperature beyond the material's own, "
        "which moves the force by {size}",
        beside=x,
    )


def _of_members(records: Records, case: Case, x: np.ndarray) -> Iterator[Contrast]:
    for turns, often in ((1, "once"), (2, "twice")):
        for wave in (np.cos, np.sin):
            yield Contrast(
                "angle",
                wave(turns * np.asarray(records.angle)) * x,
                ("goes", "goes"),
                f"the stiffness {{way}} with the angle, {often} a turn, "
                "which moves the force by {size}",
                beside=x,
            )
    runs, gears = case.run_labels, case.specimen_labels
    for k in range(1, len(runs) if len(runs) <= _MOST_MEMBERS else 0):
        yield Contrast(
            "run",
            (np.asarray(records.run) >= k).astype(float),
            ("up", "down"),
            f"the zero steps {{way}} by {{size}} from run {runs[k - 1]} to {runs[k]}",
        )
    # The first and the last against the others are steps.
    for k in range(1, len(runs) - 1 if len(runs) <= _MOST_MEMBERS else 0):
        yield Contrast(
            "run",
            (np.asarray(records.run) == k).astype(float),
            ("higher", "lower"),
            f"the zero of run {runs[k]} lies {{size}} {{way}} than that of the others",
        )
    for k in range(len(gears) if 1 < len(gears) <= _MOST_MEMBERS else 0):
        yield Contrast(
            "specimen",
            (np.asarray(records.specimen) == k) * x,
            ("stiffer", "softer"),
            f"gear {gears[k]} is {{way}} than the others, "
            "which moves its force by {size}",
            beside=x,
        )
