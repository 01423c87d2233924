"""Patterns that readings show whatever their cause: contrasts beyond the noise.

The clearest contrast is taken first and joins the base model; the others are then
tested on what it leaves, at a family-wise error of 1 % in all. The size of a contrast
is its swing from the lowest to the highest place.
"""

from dataclasses import replace

import numpy as np
from scipy.special import ndtri

from hdcal.data.case import Case
from hdcal.data.loading import loading_side
from hdcal.data.prior import Prior
from hdcal.diagnosis.contrasts import Contrast, contrasts
from hdcal.diagnosis.which import MATTERS
from hdcal.evidence.base_model import moments
from hdcal.evidence.linear_problem import LinearProblem
from hdcal.inference.force_model.residual_shapes import (
    Correlated,
    Structure,
    Whitened,
    find_structure,
)
from hdcal.inference.force_model.serial_correlation import CORRELATION
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
    """A pattern of the readings, whatever its cause.

    Attributes:
        statement: in words.
        covariate: on which it depends.
        size_N: from its lowest to its highest place, simultaneous 95 % interval.
        p_value: adjusted for all patterns that were tested.
        material: it is more than 0.025 % of the largest force.
    """

    statement: Words
    covariate: Words
    size_N: Interval
    p_value: Probability
    material: bool


def find_patterns(problem: LinearProblem, case: Case) -> tuple[Seen, ...]:
    """Return the contrasts that noise would rarely show, the clearest first.

    Args:
        problem: rows and base model.
        case: for labels and the correlation of its noise.
    """
    records = problem.records
    # Of a gear that is pulled the statements are about the size of its force.
    side = loading_side(np.asarray(records.deformation))
    sign = float(side or 1)
    turned = ("deformation", "sense", "rate")
    turned = replace(records, **{n: sign * getattr(records, n) for n in turned})
    x = np.asarray(turned.deformation) / np.max(np.abs(turned.deformation))
    known_alpha = moments(problem.priors, "alpha")[1] < _ANY_MATERIAL
    every = contrasts(turned, case, both=side == 0, known_alpha=known_alpha)
    tried = {str(index): each for index, each in enumerate(every)}
    swing = {name: each.swing(x) for name, each in tried.items()}
    tried = {n: each for n, each in tried.items() if swing[n] > _NOTHING}
    sd = problem.noise_sd / np.asarray(problem.weight)
    base = problem.X
    if not known_alpha:
        base = np.delete(base, _MODULUS_LOSS, axis=1)
    stated = case.gear.scale_priors[CORRELATION]
    prior = _CORRELATION if stated.family == "uniform" else stated
    noise = Correlated(problem.before, prior)
    found = _found(_whitened(sign * problem.y, base, tried, sd), sd, noise, turned.run)
    # Of loops with the same statement the clearest counts.
    once: dict[str, Structure] = {}
    for each in found:
        contrast = tried[each.name]
        same = contrast.words if contrast.covariate == "direction" else each.name
        once.setdefault(same, each)
    scale = float(np.max(np.abs(records.force)))
    quantile = float(-ndtri((1.0 - INTERVAL) / (2.0 * max(len(tried), 1))))
    clearest = sorted(once.values(), key=lambda each: each.p_value)
    return tuple(
        _seen(tried[each.name], each, swing[each.name], scale, quantile, case)
        for each in clearest
    )


def _whitened(
    y: np.ndarray, base: np.ndarray, tried: dict[str, Contrast], sd: np.ndarray
) -> Whitened:
    """Return readings, base and contrasts in noise sds; slope and zero are free.

    The other columns of the base are held by their priors.
    """
    held = np.eye(base.shape[1])[2:]
    none = np.zeros(len(held))
    return Whitened(
        residual=np.concatenate([y / sd, none]),
        absorbed=np.vstack([base / sd[:, None], held]),
        shapes={
            name: (np.concatenate([each.column / sd, none]), "", "")
            for name, each in tried.items()
        },
    )


def _found(
    data: Whitened, sd: np.ndarray, noise: Correlated, run
) -> tuple[Structure, ...]:
    """Search contrasts within runs first, then between runs.

    Zeros that differ from run to run would pass for noise that is correlated over a
    long time, of which a loop is a part. So at first each run has a free zero.
    """
    zeros = np.asarray(run)[:, None] == np.unique(run)
    if zeros.shape[1] == 1:
        return find_structure(data, sd, noise)
    below = np.zeros((len(data.residual) - len(sd), zeros.shape[1]))
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


def _seen(
    contrast: Contrast,
    found: Structure,
    swing: float,
    scale: float,
    quantile: float,
    case: Case,
) -> Seen:
    size, half = abs(found.coefficient) * swing, quantile * found.error * swing
    way, words = contrast.ways[found.coefficient < 0.0], load(size, case.units)
    return Seen(
        statement=case.units.say(contrast.words.format(way=way, size=words)),
        covariate=contrast.covariate,
        size_N=Interval(median=size, lo=max(size - half, 0.0), hi=size + half),
        p_value=found.p_value,
        material=size >= MATTERS * scale,
    )
