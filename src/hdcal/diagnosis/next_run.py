"""Suggested runs, ranked by their information about the cause for their effort.

The information is that between the true hypothesis and the readings of a run, which are
Gaussian under each [nat]; a remainder predicts nothing and is left out.

Source: Kolchinsky and Tracey, Entropy 19 (2017), a lower bound from Bhattacharyya
distances.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Float

from hdcal.data.records import Records
from hdcal.evidence.base_model import base_columns
from hdcal.evidence.components import effect_curves
from hdcal.evidence.linear_problem import padded_records
from hdcal.evidence.parts import LinearPosterior, Part, coefficients, posterior
from hdcal.evidence.search import Searched
from hdcal.evidence.table import OUTSIDE, Names
from hdcal.report.item import EffectName, Item, Words

# Rows of every suggested run. Seconds between rows where no time was measured, and
# those of a hold in all.
_ROWS, _PACE, _HOLD = 32, 5.0, 60.0
# Changes of temperature [°C] that are suggested, and that count as one.
_WARMER, _SAME = 30.0, 5.0
# Hypotheses that take part, their least share, and the least that is worth a run.
_MOST, _LEAST_SHARE, _LEAST_NATS = 6, 0.01, 0.02


class NextRun(Item):
    """One run that a rig can do, and the two hypotheses that it separates best."""

    run: Words
    separates: tuple[tuple[EffectName, ...], tuple[EffectName, ...]]
    information_nats: float


class CandidateRun(NamedTuple):
    """A run in words, its effort over that of a ramp, and its rows."""

    words: str
    effort: float
    records: Records


def candidate_runs(
    records: Records, reference_temperature: float
) -> Iterator[CandidateRun]:
    """Yield runs that show what the measured ones cannot, given T_ref [°C]."""
    known, paths, pace = records.known, _paths(records), _pace(records)
    warmth = np.asarray(records.temperature)
    first, last = float(warmth[0]), float(warmth[-1])
    near = abs(last - reference_temperature) < 0.5 * _WARMER
    other = last + _WARMER if near else reference_temperature

    def run(words, effort, path, pace=pace, **columns):
        return CandidateRun(words, effort, _run(records, path, pace, **columns))

    loop = paths["loop"]
    if "unloading" not in known:
        yield run("load and unload at the same rate", 1.5, loop)
    timed = "time" in known
    if timed and "rates" not in known:
        yield run("load and unload four times faster", 1.5, loop, pace / 4.0)
        yield run("load and unload ten times slower", 4.0, loop, 10.0 * pace)
    if timed and "holds" not in known:
        yield run(
            "load, then hold the largest {displacement} for one minute",
            2.0,
            paths["hold"],
        )
    if np.ptp(warmth) <= _SAME:
        words = f"load and unload at {other:.0f} °C"
        yield run(words, 6.0, loop, temperature=other)
    elif abs(first - last) > _SAME:
        words = f"return to the first temperature, {first:.0f} °C, and load again"
        yield run(words, 6.0, loop, temperature=first)
    words = "re-seat the part and load again in finer steps at small {displacement}s"
    yield run(words, 2.0, paths["fine"])
    yield run(
        "small cycles between 0.5 and 0.7 of the largest {displacement}",
        1.5,
        paths["inner"],
    )
    yield run("load to 1.25 times the largest {displacement}", 5.0, paths["beyond"])
    if np.ptp(records.angle) < np.pi / 2.0:
        angle = float(records.angle[-1]) + np.pi / 2.0
        yield run("turn the part by 90° and load again", 2.0, paths["up"], angle=angle)
    if "specimens" not in known:
        words, gear = "load a second part of the same kind", int(records.specimen[0])
        yield run(words, 8.0, paths["up"], specimen=gear + 1)


def _paths(records: Records) -> dict[str, np.ndarray]:
    """Return deformations [mm] by name, of `_ROWS` rows each."""
    low, top = float(np.min(records.deformation)), float(np.max(records.deformation))
    # Both signs are loads.
    low, top = (low, top) if abs(top) >= abs(low) else (top, low)
    up = np.linspace(low, top, _ROWS)
    small = np.linspace(0.5, 0.7, _ROWS // 4) * top
    return {
        "up": up,
        "loop": np.concatenate([up[::2], up[::-2]]),
        "fine": low + (top - low) * np.linspace(0.0, 1.0, _ROWS) ** 2,
        "inner": np.concatenate([small, small[::-1], small, small[::-1]]),
        "hold": np.concatenate([up[::2], np.full(_ROWS // 2, top)]),
        "beyond": 1.25 * up,
    }


def _pace(records: Records) -> float:
    """Return the usual seconds between rows of the last run."""
    steps = np.diff(np.asarray(records.time)[records.run == records.run[-1]])
    steps = steps[steps > 0.0]
    measured = "time" in records.known and steps.size
    return float(np.median(steps)) if measured else _PACE


def _run(records: Records, path, pace: float, **columns) -> Records:
    """Return a run along a path; what is not given stays as in the last row."""
    step = np.diff(path, prepend=2.0 * path[0] - path[1])
    direction = np.sign(step)
    moving = np.maximum.accumulate(np.where(direction, np.arange(len(path)), 0))
    held = direction == 0.0
    hold = _HOLD / max(np.count_nonzero(held), 1)
    names = "temperature", "angle", "specimen"
    last = {name: np.asarray(getattr(records, name))[-1] for name in names}
    return replace(
        records,
        deformation=path,
        time=np.cumsum(np.where(held, hold, pace)),
        direction=direction,
        sense=direction[moving],
        rate=np.where(held, 0.0, step / pace),
        run=np.full(len(path), int(np.max(records.run)) + 1),
        force=np.zeros(len(path)),
        force_sd=np.full(len(path), float(np.mean(records.force_sd))),
        **{n: np.full(len(path), v) for n, v in (last | columns).items()},
    )


def rank_runs(
    searched: Searched, posterior_of: Mapping[Names, np.ndarray]
) -> tuple[NextRun, ...]:
    """Rank runs by their information about the cause for their effort, best first."""
    share, problem = _likeliest(searched, posterior_of), searched.problem
    if len(share) < 2:
        return ()
    weight, names, table = np.array([*share.values()]), [*share], searched.table
    parts = [table.parts.get(key, []) for key in names]
    fits = [
        posterior(problem, table.likeliest_noise(key), each)
        for key, each in zip(names, parts, strict=True)
    ]
    ranked = []
    for run in candidate_runs(problem.records, problem.reading.reference_temperature):
        apart = _distances(*_predicted(searched, parts, fits, run.records))
        nats = float(-weight @ np.log(np.exp(-apart) @ weight))
        if nats >= _LEAST_NATS:
            farthest = np.argmax(apart * np.outer(weight, weight))
            one, two = sorted(np.unravel_index(farthest, apart.shape))
            found = NextRun(
                run=run.words,
                separates=(names[one], names[two]),
                information_nats=nats,
            )
            ranked.append((round(nats / run.effort, 2), found))
    ranked.sort(key=lambda item: -item[0])
    return tuple(run for _, run in ranked)


def _likeliest(
    searched: Searched, posterior_of: Mapping[Names, np.ndarray]
) -> dict[Names, float]:
    """Return the most probable effects and pairs, and none, with their shares."""
    share: dict[Names, float] = defaultdict(float)
    for key, chance in posterior_of.items():
        names = tuple(name for name in key if name != OUTSIDE)
        if names in searched.table.parts or not key:
            share[names] += float(chance.sum())
    best = sorted(share, key=lambda names: -share[names])[:_MOST]
    best = [names for names in best if share[names] >= _LEAST_SHARE]
    if len(best) > 2 and () in best:
        # More of the same readings shows whether there is a gap, not its cause.
        best.remove(())
    total = sum(share[names] for names in best)
    return {names: share[names] / total for names in best}


def _predicted(
    searched: Searched,
    hypotheses: Sequence[Sequence[Part]],
    fits: Sequence[LinearPosterior],
    run: Records,
) -> tuple[Float[np.ndarray, "h m"], Float[np.ndarray, "h m m"]]:
    """Return mean [N] and covariance of the readings of a run after all measured."""
    problem = searched.problem
    about = problem.reading, problem.priors, problem.base, problem.log_sd
    base = base_columns(run, *about)
    after = padded_records(
        jax.tree.map(lambda *both: np.concatenate(both), problem.records, run)
    )
    mean, covariance = [], []
    for parts, fit in zip(hypotheses, fits, strict=True):
        columns = np.zeros((_ROWS, len(fit.mean)))
        columns[:, : base.shape[1]] = base
        offset = np.zeros(_ROWS)
        for part, place in zip(parts, coefficients(problem, parts), strict=True):
            start, slope = _on_run(searched, part, after)
            offset += start
            columns[:, place][:, : len(slope)] = slope.T
        mean.append(offset + columns @ fit.mean)
        half = columns @ fit.factor.T
        covariance.append(half @ half.T + problem.noise_sd**2 * np.eye(_ROWS))
    return np.stack(mean), np.stack(covariance)


def _on_run(searched: Searched, part: Part, after: Records):
    """Return the part on the last rows at its mean, and its change per sd [N]."""
    problem, grid = searched.problem, searched.components.grids[part.component]
    count, rows = len(part.mean), len(problem.y)
    if grid is None:
        # The deviation of a new member is unknown.
        return np.zeros(_ROWS), np.zeros((count, _ROWS))
    # Several amplitudes are linear, in units of the rms of their priors.
    ends = part.chord if count == 1 else np.diag(grid.rms)
    values = grid.at(np.array(ends), part.shape)
    curves = effect_curves(grid.effect, values, problem.base, after, problem.reading)
    curves = curves[:, rows : rows + _ROWS]
    if count > 1:
        return np.zeros(_ROWS), part.sd[:, None] * curves
    low, high = part.chord
    slope = (curves[1] - curves[0]) / (high - low)
    return curves[0] + (part.mean[0] - low) * slope, part.sd[0] * slope[None]


def _distances(mean, covariance) -> Float[np.ndarray, "h h"]:
    """Return the Bhattacharyya distances between Gaussians."""
    gap, both = mean[:, None] - mean, 0.5 * (covariance[:, None] + covariance)
    squared = np.sum(gap * np.linalg.solve(both, gap[..., None])[..., 0], axis=-1)
    own, joint = (np.linalg.slogdet(each)[1] for each in (covariance, both))
    return squared / 8.0 + 0.5 * joint - 0.25 * (own[:, None] + own)
