"""Plans of cases, drawn from mixes."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from typing import Literal

import numpy as np

from benchmarks.blind.label import CaseKind
from benchmarks.blind.rig.loadings import LOADINGS, POINTS
from benchmarks.blind.rig.mechanisms import MECHANISMS
from benchmarks.blind.rig.noise import NOISES
from benchmarks.blind.rig.outside import OUTSIDE

# Share of cases with serially correlated noise.
_SERIAL = 0.25
Noise = Literal["iid", "ar", "strong", "log"]
# Time constant of correlated noise, in readings of half a loop. Noise that is the same
# for longer is drift; a log is read faster than its rig moves.
TIME_CONSTANTS: dict[Noise, tuple[float, float]] = {
    "strong": (0.1, 0.2),
    "log": (0.03, 0.12),
}
# Readings of half a loop: records of 60 to 1,944 rows.
SPARSE_AND_DENSE = (3, 6, 40, 160)
# Shares of the effect in the mean square of the gap of a composite.
_EFFECT_SHARES = (0.9, 0.7)
# The whole design, and its parts.
RIGS = "rigs"
MIXES = (RIGS, "effect", "withheld", "composite", "outside", "null")


@dataclass(frozen=True)
class Plan:
    """What is to be simulated; the fields are those of `Label`.

    Attributes:
        noise: independent, serially correlated (0.1 to 0.5), or as `TIME_CONSTANTS`.
        share: of the effect in the mean square of the gap.
        points: readings of half a loop.
    """

    kind: CaseKind
    truth: tuple[str, ...]
    r: float
    loading: str
    noise: Noise = "iid"
    withheld: tuple[str, ...] = ()
    outside: str = ""
    share: float = 1.0
    points: int = POINTS

    @property
    def part(self) -> str:
        """Part of the design that the plan belongs to."""
        return "withheld" if self.withheld else self.kind


def draw_plans(mix: str, count: int, rng: np.random.Generator) -> list[Plan]:
    """Draw the plans of a set, one of `MIXES`: its design in random order, repeated."""
    design = [plan for plan in _design() if mix in (RIGS, plan.part)]
    plans = []
    while len(plans) < count:
        plans += [_completed(design[i], rng) for i in rng.permutation(len(design))]
    return plans[:count]


def _completed(plan: Plan, rng: np.random.Generator) -> Plan:
    """Return the plan with its noise and its second withheld effect drawn."""
    if plan.kind == "null":
        return plan
    noise = "ar" if rng.uniform() < _SERIAL else "iid"
    withheld = plan.withheld
    if withheld:
        # Two are withheld, so that the true one cannot be read off the set.
        others = [name for name in effects_on(plan.loading) if name not in withheld]
        withheld = tuple(sorted((*withheld, str(rng.choice(others)))))
    return replace(plan, noise=noise, withheld=withheld)


def _design() -> Iterator[Plan]:
    """Yield one round, a quarter of it effects on the rich loading."""
    shown, others = effects_on("rich"), ("lean", "ramp", "rates", "holds", "angles")
    for name, r in product(shown, (0.5, 1.0, 2.0)):
        yield Plan("effect", (name,), r, "rich")
    for number, name in enumerate(shown):
        points = SPARSE_AND_DENSE[number % len(SPARSE_AND_DENSE)]
        yield Plan("effect", (name,), 1.0, "rich", points=points)
        yield Plan("effect", (name,), 1.0, "rich", withheld=(name,))
    for number, name in enumerate(n for n in shown if n not in NOISES):
        outside = tuple(OUTSIDE)[(3 * number) % len(OUTSIDE)]
        for share in _EFFECT_SHARES:
            more = {"outside": outside, "share": share}
            yield Plan("composite", (name,), 1.0, "rich", **more)
    for loading in (*others, "fleet"):
        for name in effects_on(loading)[::3]:
            yield Plan("effect", (name,), 1.0, loading)
    for number, name in enumerate(OUTSIDE):
        yield Plan("outside", (name,), (1.0, 2.0)[number % 2], "rich")
    for noise in ("iid", "ar"):
        for points in (POINTS, *SPARSE_AND_DENSE):
            yield Plan("null", (), 0.0, "rich", noise, points=points)
        for loading in ("lean", "ramp", "fleet"):
            yield Plan("null", (), 0.0, loading, noise)
    # Among fewer readings such noise is no more than serial.
    for points in (20, 25, 30, 40, 50, 60, 80, 120, 160, 160):
        yield Plan("null", (), 0.0, "rich", "strong", points=points)
    for points in (60, 60, 80, 80, 100, 120, 120, 140, 160, 160):
        yield Plan("null", (), 0.0, "rich", "log", points=points)


@cache
def effects_on(loading: str) -> tuple[str, ...]:
    """Return the effects that a loading of `LOADINGS` can show."""
    features = LOADINGS[loading]().features
    mean = [name for name, each in MECHANISMS.items() if each.needs <= features]
    return (*mean, *NOISES)


def other_truth(plan: Plan, rng: np.random.Generator) -> Plan:
    """Return the plan with another mechanism drawn, none of the noise."""
    decoys = {*plan.withheld} - {*plan.truth}
    shown = OUTSIDE if plan.kind == "outside" else effects_on(plan.loading)
    names = [name for name in shown if name not in {*decoys, *NOISES}]
    truth = (str(rng.choice(names)),)
    withheld = tuple(sorted({*decoys, *truth})) if plan.withheld else ()
    outside = str(rng.choice(tuple(OUTSIDE))) if plan.outside else ""
    return replace(plan, truth=truth, withheld=withheld, outside=outside)
