"""Plans of cases, drawn from mixes."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import islice, product
from typing import Literal

import numpy as np

from benchmarks.blind.label import CaseKind
from benchmarks.blind.rig.loadings import LOADINGS, POINTS
from benchmarks.blind.rig.mechanisms import MECHANISMS
from benchmarks.blind.rig.noise import NOISES
from benchmarks.blind.rig.outside import OUTSIDE

SIZES = (0.2, 0.3, 0.5, 1.0, 2.0, 5.0)
# Share of cases with serially correlated noise.
_SERIAL = 0.25
Noise = Literal["iid", "ar", "strong", "log"]
# Time constant of correlated noise, in readings of half a loop. Noise that is the same
# for longer is drift; a log is read faster than its rig moves.
TIME_CONSTANTS: dict[Noise, tuple[float, float]] = {
    "strong": (0.1, 0.2),
    "log": (0.03, 0.12),
}
# The mix of rigs of all sizes.
RIGS = "rigs"
# Readings of half a loop: records of 60 to 1,944 rows.
SPARSE_AND_DENSE = (3, 6, 40, 160)
# Shares of the effect in the mean square of the gap of a composite.
EFFECT_SHARES = (0.9, 0.7)
# Parts of the mix `all`.
SHARES = {
    "effects": 0.45,
    "null": 0.13,
    "outside": 0.11,
    "withheld": 0.05,
    "programs": 0.06,
    "prior": 0.20,
}
MIXES = ("all", RIGS, *SHARES)


@dataclass(frozen=True)
class Plan:
    """What is to be simulated; the fields are those of `Label`.

    Attributes:
        noise: independent, serially correlated (0.1 to 0.5), or as `TIME_CONSTANTS`.
        points: readings of half a loop.
    """

    mix: str
    kind: CaseKind
    truth: tuple[str, ...]
    r: float
    loading: str
    noise: Noise = "iid"
    withheld: tuple[str, ...] = ()
    outside: str = ""
    share: float = 1.0
    points: int = POINTS


def draw_plans(mix: str, count: int, rng: np.random.Generator) -> list[Plan]:
    """Draw the plans of a set, one of `MIXES`, in random order."""
    if mix != "all":
        return list(islice(_endless(mix, rng), count))
    counts = {name: round(share * count) for name, share in SHARES.items()}
    counts["effects"] += count - sum(counts.values())
    plans = [p for name, n in counts.items() for p in islice(_endless(name, rng), n)]
    return [plans[i] for i in rng.permutation(count)]


def _endless(mix: str, rng: np.random.Generator) -> Iterator[Plan]:
    """Yield plans: the whole design in random order, again and again."""
    if mix == "prior":
        while True:
            yield _expected(rng)
    design = list(_design(mix))
    while True:
        for index in rng.permutation(len(design)):
            plan = design[index]
            fixed = mix == "null" or plan.kind == "null"
            yield plan if fixed else replace(plan, noise=_noise(rng))


def _design(mix: str) -> Iterator[Plan]:
    if mix == RIGS:
        yield from _rigs()
    elif mix == "null":
        names = ("rich", "rich", "lean", "ramp", "fleet")
        for loading, noise in product(names, ("iid", "ar")):
            yield Plan(mix, "null", (), 0.0, loading, noise)
    elif mix == "effects":
        for r in SIZES:
            for name in effects_on("rich"):
                # Twice at the sizes that have targets.
                for _ in range(2 if r in (0.5, 1.0) else 1):
                    yield Plan(mix, "effect", (name,), r, "rich")
            for name in effects_on("lean") if r >= 0.5 else ():
                yield Plan(mix, "effect", (name,), r, "lean")
    elif mix == "outside":
        for name, r in product(OUTSIDE, (1.0, 2.0)):
            yield Plan(mix, "outside", (name,), r, "rich")
    elif mix == "withheld":
        # Two are withheld, so that the true one cannot be read off the set.
        for name, other in product(effects_on("rich"), repeat=2):
            if other != name:
                both = tuple(sorted((name, other)))
                yield Plan(mix, "effect", (name,), 1.0, "rich", withheld=both)
    else:
        for loading in ("ramp", "rates", "holds", "angles", "fleet"):
            for name in effects_on(loading):
                yield Plan(mix, "effect", (name,), 1.0, loading)


def _rigs() -> Iterator[Plan]:
    """Yield one round of the mix `rigs`, a quarter of it effects that have targets."""
    shown, others = effects_on("rich"), ("lean", "ramp", "rates", "holds", "angles")
    for name, r in product(shown, (0.5, 1.0, 2.0)):
        yield Plan(RIGS, "effect", (name,), r, "rich")
    for number, name in enumerate(shown):
        points = SPARSE_AND_DENSE[number % len(SPARSE_AND_DENSE)]
        yield Plan(RIGS, "effect", (name,), 1.0, "rich", points=points)
        decoy = shown[(number + 7) % len(shown)]
        both = tuple(sorted((name, decoy)))
        yield Plan(RIGS, "effect", (name,), 1.0, "rich", withheld=both)
    for number, name in enumerate(n for n in shown if n not in NOISES):
        outside = tuple(OUTSIDE)[(3 * number) % len(OUTSIDE)]
        for share in EFFECT_SHARES:
            more = {"outside": outside, "share": share}
            yield Plan(RIGS, "composite", (name,), 1.0, "rich", **more)
    for loading in (*others, "fleet"):
        for name in effects_on(loading)[::3]:
            yield Plan(RIGS, "effect", (name,), 1.0, loading)
    for number, name in enumerate(OUTSIDE):
        yield Plan(RIGS, "outside", (name,), (1.0, 2.0)[number % 2], "rich")
    for noise in ("iid", "ar"):
        for points in (POINTS, *SPARSE_AND_DENSE):
            yield Plan(RIGS, "null", (), 0.0, "rich", noise, points=points)
        for loading in ("lean", "ramp", "fleet"):
            yield Plan(RIGS, "null", (), 0.0, loading, noise)
    # Among fewer readings such noise is no more than serial.
    for points in (20, 25, 30, 40, 50, 60, 80, 120, 160, 160):
        yield Plan(RIGS, "null", (), 0.0, "rich", "strong", points=points)
    for points in (60, 60, 80, 80, 100, 120, 120, 140, 160, 160):
        yield Plan(RIGS, "null", (), 0.0, "rich", "log", points=points)


def _noise(rng: np.random.Generator) -> Noise:
    return "ar" if rng.uniform() < _SERIAL else "iid"


def _expected(rng: np.random.Generator) -> Plan:
    """Draw a plan with none ½, unknown 1/10, pairs 3 % and effects for the rest."""
    loading = str(rng.choice(["rich", "lean"]))
    noise, r = _noise(rng), float(rng.choice(SIZES))
    kinds: tuple[CaseKind, ...] = ("null", "outside", "pair", "effect")
    kind = kinds[rng.choice(4, p=[0.5, 0.1, 0.03, 0.37])]
    if kind == "null":
        return Plan("prior", kind, (), 0.0, loading, noise)
    truth = ("",) * (2 if kind == "pair" else 1)
    plan = Plan("prior", kind, truth, r, loading, noise)
    return other_truth(plan, rng, noises=kind == "effect")


@cache
def effects_on(loading: str) -> tuple[str, ...]:
    """Return the effects that a loading of `LOADINGS` can show."""
    features = LOADINGS[loading]().features
    mean = [name for name, each in MECHANISMS.items() if each.needs <= features]
    return (*mean, *NOISES)


def other_truth(plan: Plan, rng: np.random.Generator, *, noises: bool = False) -> Plan:
    """Return the plan with other mechanisms drawn, as many as it has.

    Args:
        plan: the plan.
        rng: source of random numbers.
        noises: whether effects of the noise may be drawn too.
    """
    names = effects_on(plan.loading)
    if plan.kind == "outside":
        names = tuple(OUTSIDE)
    decoys = {*plan.withheld} - {*plan.truth}
    left_out = decoys | ({*NOISES} if not noises else set())
    names = [name for name in names if name not in left_out]
    drawn = rng.choice(names, len(plan.truth), replace=False)
    truth = tuple(sorted(map(str, drawn)))
    withheld = tuple(sorted({*decoys, *truth})) if plan.withheld else ()
    outside = str(rng.choice(tuple(OUTSIDE))) if plan.outside else ""
    return replace(plan, truth=truth, withheld=withheld, outside=outside)
