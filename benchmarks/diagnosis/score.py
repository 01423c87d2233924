"""One made-up case: diagnosed, and compared with what is true."""

import time
from dataclasses import dataclass
from functools import cache

import numpy as np

from benchmarks.diagnosis import causes
from benchmarks.diagnosis.loadings import LOADINGS, line
from benchmarks.diagnosis.oracle import judge
from benchmarks.diagnosis.world import World, draw_noise, draw_world
from hdcal.data.records import Records
from hdcal.diagnosis.diagnose import diagnose
from hdcal.diagnosis.verdict import Verdict
from hdcal.physics.registry import EFFECTS

# Rigs on which an effect is tried before it counts as not reaching r.
_TRIES = 30
# What the noise of a case without gap is: AR(1) coefficient, degrees of freedom.
NOISES = {"iid": (0.0, 0), "AR(1) ρ = .5": (0.5, 0), "Student t₄": (0.0, 4)}


@dataclass(frozen=True)
class Task:
    """What to make.

    Attributes:
        program: rich, lean, or the number of rows of a line.
        effects: true causes; none, one or two.
        r: size of each.
        noise: key of `NOISES`.
        index: of the case among those alike; its seed.
    """

    program: str
    effects: tuple[str, ...]
    r: float
    noise: str
    index: int

    def rng(self, seed: int) -> np.random.Generator:
        """Return a source of randomness of this task alone."""
        words = f"{self.program} {self.effects} {self.r} {self.noise}"
        return np.random.default_rng([seed, self.index, *words.encode()])


@cache
def records_of(program: str) -> Records:
    return LOADINGS[program]() if program in LOADINGS else line(int(program))


def score(task: Task, seed: int) -> dict:
    """Make a case, diagnose it, and return a flat row of what came out."""
    rng = task.rng(seed)
    row = {
        "program": task.program,
        "truth": list(task.effects),
        "r": task.r,
        "noise": task.noise,
        "index": task.index,
    }
    made = _make(task, rng)
    if made is None:
        return row | {"reachable": False}
    world, drawn = made
    correlation, tails = NOISES[task.noise]
    force = world.plain + draw_noise(world, rng, correlation, tails)
    force = force + sum(each.curve for each in drawn)
    began = time.perf_counter()
    verdict = diagnose(world.case(force), quick=True, seed=task.index)
    row |= {"reachable": True, "seconds": time.perf_counter() - began}
    row |= _said(verdict)
    if len(drawn) == 1:
        row |= _oracle(world, force, task) | _sizes(verdict, task, drawn[0])
    return row


def _make(task: Task, rng) -> tuple[World, list[causes.Drawn]] | None:
    """Draw rigs until one shows every effect at size r."""
    for _ in range(_TRIES):
        world = draw_world(records_of(task.program), rng)
        drawn = [causes.draw(name, world, task.r, rng) for name in task.effects]
        if all(drawn):
            return world, drawn
    return None


def _said(verdict: Verdict) -> dict:
    which = verdict.which
    share = which.probabilities
    return {
        "top": max(share, key=lambda name: share[name]),
        "detected": verdict.gap.detected,
        "p_value": verdict.where.p_value,
        "correlation": verdict.gap.autocorrelation,
        "verdict": which.verdict,
        "effect": which.effect,
        "second": which.second_effect,
        "set": list(which.set),
        "inclusion": {n: p for n, p in which.inclusion.items() if p > 1e-3},
        "p_none": share["none"],
        "p_unknown": share.get("unknown", 0.0),
    }


def _oracle(world: World, force: np.ndarray, task: Task) -> dict:
    share = judge(world, force, task.r)
    return {
        "oracle": max(share, key=lambda name: share[name]),
        "oracle_share": share.get(task.effects[0], 0.0),
    }


def _sizes(verdict: Verdict, task: Task, drawn: causes.Drawn) -> dict:
    """Return amplitude and closed share where the right effect was found."""
    found, far = verdict.which.amplitude, verdict.shrink
    if verdict.which.effect != task.effects[0]:
        return {}
    row = {}
    if far.closed is not None:
        row |= {"closed": far.closed.median, "placebo": far.placebo_closed}
        row |= {"closed_lo": far.closed.lo, "closed_hi": far.closed.hi}
    if found is not None and drawn.amplitude is not None:
        error = found.median / drawn.amplitude - 1.0
        inside = found.lo <= drawn.amplitude <= found.hi
        row |= {"amplitude_error": error, "amplitude_inside": bool(inside)}
    return row


def family(name: str | None) -> str | None:
    """Return the family of an effect; the two readings of a thermal zero share one."""
    return EFFECTS[name].family if name in EFFECTS else None
