"""Bands on the predicted force.

A prediction is an immediate reading: no time passes, so that leakage and other slow
effects have not begun.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from hdcal.data.case import Case
from hdcal.data.plausible import implausible
from hdcal.data.records import Records, lies_far
from hdcal.data.theory_names import SPRING
from hdcal.errors import Finding, Findings, InputError
from hdcal.prediction.bands.result import COLUMNS, Bands
from hdcal.prediction.conditions import (
    DIRECTIONS,
    SENSE,
    Conditions,
    Direction,
    beyond_tested,
    excluded_findings,
    far_findings,
    is_tested,
    temperature_findings,
    usual_temperature,
    widest,
)
from hdcal.prediction.joint import JointModel, joint
from hdcal.prediction.members import over_draws
from hdcal.prediction.models import (
    Models,
    averaging_words,
    left_out_of,
    probabilities,
)
from hdcal.prediction.simulate import simulate

# Rows predicted at a time: with 4000 draws each array of a block takes 32 MB.
_BLOCK = 1000
# More temperatures than this are shown at three over their range; those of one room
# are one temperature [K].
_MOST_TEMPERATURES, _SAME_TEMPERATURE = 6, 3.0


def predict(
    models: Models,
    deformation: Sequence[float] | np.ndarray,
    temperature: Sequence[float] | np.ndarray | None = None,
    direction: Direction | None = None,
    *,
    interval: float = 0.95,
    seed: int = 0,
    allow_failed: bool = False,
) -> Bands:
    """Predict the force at every pair of deformation and temperature.

    Args:
        models: a calibration, a diagnosis, or posteriors with their probabilities.
        deformation: as read [mm], shape (n,).
        temperature: of the specimen [°C], shape (t,); by default the tested one
            nearest to the reference.
        direction: of the movement: up where the deformation rises, as read and with
            its sign; by default the one that loads the gear.
        interval: probability inside the bands.
        seed: of what the draws leave open.
        allow_failed: also for a posterior that failed; the rows then say so.

    Returns:
        Bands with t · n rows, deformation varying fastest.

    Raises:
        NotUsable: the posterior failed its checks.
        InputError: empty or non-finite input.
    """
    model = joint(models, allow_failed=allow_failed)
    case = model.posterior.case
    warm = usual_temperature(case) if temperature is None else temperature
    along = _numbers("deformation", deformation)
    levels = _numbers("temperature", warm)
    with Findings() as wrong:
        wrong += _deformation_findings(case, along, direction)
        wrong += temperature_findings(case.gear, model.draws, levels)
        wrong += implausible("interval", interval) + implausible("seed", seed)
        if direction not in (None, *DIRECTIONS):
            words = f"'{direction}' is not a direction"
            wrong.append(Finding("direction", words, "Use up or down"))
    at, warm = np.tile(along, len(levels)), np.repeat(levels, len(along))
    loading = _loading(at, case)
    sense = loading if direction is None else np.full(len(at), SENSE[direction])
    tails = [0.5 - interval / 2.0, 0.5, 0.5 + interval / 2.0]
    blocks = []
    for start in range(0, len(at), _BLOCK):
        rows = slice(start, start + _BLOCK)
        place = at[rows], warm[rows], loading[rows], (sense != loading)[rows]
        blocks.append(_quantiles(model, Conditions.of(*place), tails, seed))
    mean, physics, new, straight = (
        np.concatenate(part, axis=-1) for part in zip(*blocks, strict=True)
    )
    fitted = model.problem.discrepancy is not None
    with_gap = mean if fitted else np.full_like(mean, np.nan)
    columns = np.concatenate([physics, with_gap, new])
    bands = [name for name in COLUMNS if name.endswith("_N")]
    usable = all(part.posterior.usable for part in model.models)
    return Bands(
        **dict(zip(bands, columns, strict=True)),
        deformation_mm=at,
        temperature_C=warm,
        direction=np.where(sense > 0.0, "up", "down"),
        tested=is_tested(case.records, deformation=at, temperature=warm, sense=sense),
        usable=np.full(len(at), usable),
        straight_N=straight,
        interval=interval,
        causes=probabilities(model.models),
        weight_left_out=left_out_of(models),
        averaging=tuple(averaging_words(models)),
        tested_range=_range_words(case),
        contact=case.gear.contact,
        beyond_tested=max(beyond_tested(float(x), case.records) for x in along),
        part="part" if case.gear.theory == SPRING else "gear",
        units=case.units,
    )


def _quantiles(model: JointModel, at: Conditions, tails, seed: int):
    """Return quantiles [N] as arrays (tail, row).

    Of the mean, of the mean without a fitted discrepancy, of a new reading,
    (3, row) each; and the median of the model alone, (row,).
    """
    # The mean is that of the tested gears and mountings, a new reading of a new one.
    tested = members = simulate(model, at, seed=seed)
    if (population := widest(model.problem)) != "readings":
        members = simulate(model, at, population, seed=seed)
    # One new reading of each draw, the same at every row so that the curves are smooth;
    # independent of the scores of the draws, which have the same seed.
    rng = np.random.default_rng((seed, 1))
    even = (np.arange(model.size) + 0.5) / model.size
    rounding, level = rng.permutation(even), rng.permutation(even)
    new = members.quantile(level)
    new = new + float(model.problem.step) * (rounding - 0.5)[:, None]
    mean = tested.centre
    physics = mean - tested.common["discrepancy"]
    straight = physics - tested.common["bend"]
    return (
        over_draws(at.loading * mean, tails),
        over_draws(at.loading * physics, tails),
        over_draws(at.loading * new, tails),
        over_draws(at.loading * straight, 0.5),
    )


def _numbers(name: str, given: Any) -> np.ndarray:
    """Return numbers as an array, shape (n,)."""
    try:
        numbers = np.atleast_1d(np.asarray(given, dtype=float))
    except (TypeError, ValueError):
        numbers = np.empty((0, 0))
    if numbers.ndim != 1 or numbers.size == 0:
        words, remedy = "is not a list of numbers", "Give one number or more"
        raise InputError([Finding(name, words, remedy)])
    return numbers


def _loading(at: np.ndarray, case: Case) -> np.ndarray:
    """Return the direction of loading of each row, +1 where the deformation rises."""
    at, read = at - case.gear.contact, case.from_unloaded
    # A gear at rest is loaded as the tested one was.
    tested = np.min(read) + np.max(read)
    return np.where(np.where(at == 0.0, tested, at) < 0.0, -1.0, 1.0)


def _deformation_findings(
    case: Case, deformation: np.ndarray, direction: str | None
) -> list[Finding]:
    """Return what is wrong with deformations [mm], such as another unit."""
    if wrong := implausible("deformation", deformation, case.units.displacement):
        return wrong
    zero = case.gear.contact
    worst = float(deformation[np.argmax(np.abs(deformation - zero))])
    tested = float(np.max(np.abs(case.from_unloaded)))
    wrong = far_findings(case.gear, case.units, worst, tested, zero)
    sense = SENSE.get(direction or "", _loading(deformation, case))
    each = (excluded_findings(case, *pair) for pair in np.broadcast(deformation, sense))
    return wrong + next(filter(None, each), [])


def _range_words(case: Case) -> str:
    """Return the tested deformations, temperatures and directions in words."""
    records = case.records
    low, high = np.min(records.deformation), np.max(records.deformation)
    cold, warm = np.min(records.temperature), np.max(records.temperature)
    ways = [n for n in DIRECTIONS if SENSE[n] in np.asarray(records.sense)]
    warmth = f"{cold:g} °C" if cold == warm else f"{cold:g} … {warm:g} °C"
    return (
        f"{low:g} … {high:g} {case.units.displacement_unit}, {warmth}, "
        f"direction {' and '.join(ways)}"
    )


def default_bands(models: Models, interval: float = 0.95) -> Bands:
    """Return the bands of a result folder: the tested range and a tenth beyond.

    One block per tested temperature (three over the range if there are many, the middle
    one if they differ by less than 3 K) and per direction that was tested.
    """
    case = joint(models, allow_failed=True).posterior.case
    grid, levels = _default_grid(case), _default_temperatures(case.records)
    parts = [
        predict(models, grid, levels, side, interval=interval, allow_failed=True)
        for side in DIRECTIONS
        if SENSE[side] in np.asarray(case.records.sense)
        and SENSE[side] != case.excluded_sense
    ]
    whole = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in (*COLUMNS, "straight_N")
    }
    return parts[0].model_copy(update=whole)


def _default_grid(case: Case) -> np.ndarray:
    records, nominal = case.records, case.gear.nominal_deformation
    ends = [float(np.min(records.deformation)), float(np.max(records.deformation))]
    zero = case.gear.contact
    ends += [] if lies_far(case.from_unloaded) else [zero]
    ends += [] if nominal is None else [nominal]
    low, high = min(ends), max(ends)
    beyond = 0.1 * (high - low)
    # Not beyond the unloaded gear.
    low, high = low - beyond * float(low != zero), high + beyond * float(high != zero)
    for left, right in case.excluded:
        low, high = (low, left) if left >= ends[1] else (right, high)
    ends = [end for end in ends if low <= end <= high]
    # With the ends of the data themselves, so that the tested range shows whole.
    return np.union1d(np.linspace(low, high, 67), ends)


def _default_temperatures(records: Records) -> np.ndarray:
    cold, warm = np.min(records.temperature), np.max(records.temperature)
    # Rounded together, but never out of what was measured.
    levels = np.unique(np.clip(np.round(records.temperature, 1), cold, warm))
    three = np.linspace(levels[0], levels[-1], 3)
    if warm - cold < _SAME_TEMPERATURE:
        return three[1:2]
    return three if len(levels) > _MOST_TEMPERATURES else levels
