"""What is seen, whatever its cause: plain contrasts of the readings, one by one.

The clearest contrast is taken first and joins the base model; the others are then
tested on what it leaves, at a family-wise error of 1 % in all; first within runs. What
a large one hid may be clearer than it. The size of a contrast is its swing from the
lowest to the highest place.
"""

from dataclasses import replace

import numpy as np
from scipy.special import ndtri

from hdcal.data.case import Case
from hdcal.data.loading import loading_side
from hdcal.data.prior import Prior
from hdcal.data.records import Records
from hdcal.diagnosis.contrasts import Contrast, contrasts
from hdcal.diagnosis.which import MATTERS
from hdcal.evidence.linear_problem import LinearProblem
from hdcal.inference.distributions import moments
from hdcal.inference.residual_shapes import (
    Correlated,
    Structure,
    Whitened,
    find_structure,
)
from hdcal.inference.serial_correlation import CORRELATION
from hdcal.quantities import Quantities
from hdcal.report.item import INTERVAL, Interval, Item, Probability, Words
from hdcal.report.words import load

# Prior sd of the loss of modulus [1/K] that no stated material has.
_ANY_MATERIAL = 1e-3
# Correlation of neighbouring readings where the gear file states none: most rigs read
# independently, loggers with filters do not.
_CORRELATION = Prior("beta", (0.5, 1.5))
# Column of the base model: stiffness, zero of the force, loss of modulus, contact.
_MODULUS_LOSS = 2
# Swing of a column, of sizes about one, that rounding alone gives.
_NOTHING = 1e-9


class Seen(Item):
    """What readings show, whatever its cause.

    Attributes:
        statement: in words.
        covariate: with which it goes.
        size_N: from its lowest to its highest place, simultaneous 95 % interval.
        p_value: adjusted for all that was looked for.
        material: it is more than 0.025 % of the largest force.
    """

    statement: Words
    covariate: Words
    size_N: Interval
    p_value: Probability
    material: bool


def what_is_seen(problem: LinearProblem, case: Case) -> tuple[Seen, ...]:
    """Return the contrasts that noise would rarely show, the clearest first.

    Args:
        problem: rows and base model.
        case: for labels and the correlation of its noise.
    """
    # Of a gear that is pulled, what is said is said of the size of its force.
    side = loading_side(np.asarray(problem.records.deformation))
    sign = float(side or 1)
    own = moments(problem.priors["alpha"])[1] < _ANY_MATERIAL
    turned = _turned(problem.records, sign)
    every = list(contrasts(turned, case, both=side == 0, own=own))
    tried = {str(i): c for i, c in enumerate(every) if c.swing > _NOTHING}
    sd = problem.noise_sd / np.asarray(problem.weight)
    stated = case.gear.scale_priors[CORRELATION]
    expected = _CORRELATION if stated.family == "uniform" else stated
    noise = Correlated(problem.before, expected)
    data = _whitened(problem, tried, sd, sign, own=own)
    found = _found(data, sd, noise, np.asarray(turned.run))
    scale = float(np.max(np.abs(problem.records.force)))
    quantile = float(-ndtri((1.0 - INTERVAL) / (2.0 * max(len(tried), 1))))
    # A loop is told once, by the shape that shows it best.
    once: dict[str, Structure] = {}
    for each in found:
        once.setdefault(tried[each.name].told_once or each.name, each)
    clearest = sorted(once.values(), key=lambda each: each.p_value)
    told = [_seen(tried[e.name], e, scale, quantile, case.units) for e in clearest]
    if sum(each.covariate == "run" for each in told) < 2:
        return tuple(told)
    beside = [e.name for e in found if tried[e.name].covariate != "run"]
    spread = _zeros_differ(data, beside, turned.run, case, sd)
    return _as_one(told, *spread)


def _zeros_differ(
    data: Whitened, beside: list[str], run, case: Case, sd: np.ndarray
) -> tuple[float, str]:
    """Return by how much the zeros of runs differ [N], and the words for it.

    Of several contrasts each one speaks of what the others leave, which is hard to say.
    """
    others = np.asarray(run)[:, None] == np.unique(run)[1:]
    below = np.zeros((len(data.residual) - len(sd), others.shape[1]))
    table = [data.absorbed, *(data.shapes[name][0][:, None] for name in beside)]
    table.append(np.concatenate([others / sd[:, None], below]))
    table = np.concatenate(table, axis=1)
    found = np.linalg.lstsq(table, data.residual, rcond=None)[0]
    zeros = np.append(0.0, found[-others.shape[1] :])
    lowest, highest = (case.run_labels[k] for k in (zeros.argmin(), zeros.argmax()))
    size = float(np.ptp(zeros))
    least = load(size, case.units)
    words = f"the zeros of the runs differ by up to {least}, run {lowest} the "
    return size, f"{words}lowest, run {highest} the highest"


def _as_one(told: list[Seen], size: float, words: str) -> tuple[Seen, ...]:
    """Return what is seen with all that is seen of the zeros of runs as one."""
    place = next(i for i, each in enumerate(told) if each.covariate == "run")
    zeros = [each for each in told if each.covariate == "run"]
    others = [each for each in told if each.covariate != "run"]
    # A difference of two runs, of which each contrast says one against the mean; that
    # of the last one is beside all the others.
    half = np.sqrt(2.0) * min(each.size_N.hi - each.size_N.median for each in zeros)
    low, high = max(size - half, 0.0), size + half
    whole = Seen(
        statement=words,
        covariate="run",
        size_N=Interval(median=size, lo=float(low), hi=float(high)),
        p_value=zeros[0].p_value,
        material=any(each.material for each in zeros),
    )
    return (*others[:place], whole, *others[place:])


def _found(
    data: Whitened, sd: np.ndarray, noise: Correlated, run: np.ndarray
) -> tuple[Structure, ...]:
    """Look for contrasts within runs first, then for those between them.

    Zeros that differ from run to run would pass for noise that errs alike for long, of
    which a loop is a part. So at first each run has a zero of its own.
    """
    zeros = run[:, None] == np.unique(run)
    if zeros.shape[1] == 1:
        return find_structure(data, sd, noise)
    below = np.zeros((len(data.residual) - len(run), zeros.shape[1]))
    zeros = np.concatenate([zeros / sd[:, None], below])
    free = replace(data, absorbed=np.column_stack([data.absorbed, zeros]))
    within = find_structure(free, sd, noise, looks=2)
    names = [each.name for each in within]
    columns = [data.shapes[name][0] for name in names]
    rest = replace(
        data,
        absorbed=np.column_stack([data.absorbed, *columns]),
        shapes={n: shape for n, shape in data.shapes.items() if n not in names},
    )
    return (*within, *find_structure(rest, sd, noise, looks=2))


def _turned(records: Records, sign: float) -> Records:
    turned = ("deformation", "sense", "rate")
    return replace(records, **{n: sign * getattr(records, n) for n in turned})


def _whitened(
    problem: LinearProblem,
    tried: dict[str, Contrast],
    sd: np.ndarray,
    sign: float,
    *,
    own: bool,
) -> Whitened:
    """Bring readings, base and contrasts to noise sds; slope and zero are free.

    A loss of modulus is taken up as far as the material's `own` prior allows.
    """
    base = problem.X
    if not own:
        base = np.delete(base, _MODULUS_LOSS, axis=1)
    width = base.shape[1]
    below = np.eye(width)[2:]
    nothing = np.zeros(width - 2)
    return Whitened(
        residual=np.concatenate([sign * problem.y / sd, nothing]),
        absorbed=np.vstack([base / sd[:, None], below]),
        shapes={
            name: (np.concatenate([each.column / sd, nothing]), "", "")
            for name, each in tried.items()
        },
    )


def _seen(
    contrast: Contrast,
    found: Structure,
    scale: float,
    quantile: float,
    units: Quantities,
) -> Seen:
    swing = abs(found.coefficient) * contrast.swing
    half = quantile * found.error * contrast.swing
    size = Interval(median=swing, lo=max(swing - half, 0.0), hi=swing + half)
    way, told = contrast.ways[found.coefficient < 0.0], load(size.median, units)
    return Seen(
        statement=units.say(contrast.words.format(way=way, size=told)),
        covariate=contrast.covariate,
        size_N=size,
        p_value=found.p_value,
        material=size.median >= MATTERS * scale,
    )
