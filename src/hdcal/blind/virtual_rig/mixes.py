"""What the cases of a blind check are drawn from: mixes, and the plans they give."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import islice, product

import numpy as np

from hdcal.blind.label import CaseKind
from hdcal.blind.virtual_rig.loadings import LOADINGS, Loading
from hdcal.blind.virtual_rig.outside import CHOSEN, LISTED, UNSEEN
from hdcal.blind.virtual_rig.sensing import NOISES
from hdcal.blind.virtual_rig.virtual_rig import MECHANISMS
from hdcal.data.toml_file import did_you_mean
from hdcal.errors import Finding, InputError

SIZES = (0.2, 0.3, 0.5, 1.0, 2.0, 5.0)
OUTSIDE = {**LISTED, **CHOSEN, **UNSEEN}
# Share of cases whose noise is serially correlated.
_SERIAL = 0.25

MIXES = {
    "effects": "every effect of the library at every size, programs rich and lean",
    "null": "nothing is missing; half of them with serially correlated noise",
    "outside": "mechanisms that are in no library, r = 1 and 2",
    "withheld": "r = 1, the true effect taken out of the library",
    "programs": "r = 1 on the other programs",
    "prior": "in the proportions that the diagnosis expects, all sizes",
    "all": "all of these",
}
_SHARES = {
    "effects": 0.45,
    "null": 0.13,
    "outside": 0.11,
    "withheld": 0.05,
    "programs": 0.06,
    "prior": 0.20,
}


@dataclass(frozen=True)
class Plan:
    """What one case shall be; the fields mean what those of `Label` mean."""

    mix: str
    kind: CaseKind
    truth: tuple[str, ...]
    r: float
    loading: str
    serial: bool = False
    withheld: tuple[str, ...] = ()


def draw_plans(mix: str, count: int, rng: np.random.Generator) -> list[Plan]:
    """Draw the plans of a set, in random order.

    Args:
        mix: one of `MIXES`.
        count: of cases.
        rng: of all random numbers.

    Raises:
        InputError: no mix has this name.
    """
    if mix not in MIXES:
        words, remedy = f"no mix is called '{mix}'", did_you_mean(mix, list(MIXES))
        raise InputError([Finding("mix", words, remedy)])
    if mix != "all":
        return list(islice(_endless(mix, rng), count))
    counts = {name: round(share * count) for name, share in _SHARES.items()}
    counts["effects"] += count - sum(counts.values())
    found = [p for name, n in counts.items() for p in islice(_endless(name, rng), n)]
    return [found[i] for i in rng.permutation(count)]


def _endless(mix: str, rng: np.random.Generator) -> Iterator[Plan]:
    """Yield plans: the whole design in random order, again and again."""
    if mix == "prior":
        while True:
            yield _expected(rng)
    design = list(_design(mix))
    while True:
        for index in rng.permutation(len(design)):
            plan = design[index]
            serial = plan.serial if mix == "null" else bool(rng.uniform() < _SERIAL)
            yield replace(plan, serial=serial)


def _design(mix: str) -> Iterator[Plan]:
    if mix == "null":
        names = ("rich", "rich", "lean", "ramp", "fleet")
        for loading, serial in product(names, (False, True)):
            yield Plan(mix, "null", (), 0.0, loading, serial)
    elif mix == "effects":
        for r in SIZES:
            for name in effects_on("rich"):
                yield Plan(mix, "effect", (name,), r, "rich")
                # The sizes that the bar is about are looked at twice.
                if r in (0.5, 1.0):
                    yield Plan(mix, "effect", (name,), r, "rich")
            for name in effects_on("lean") if r >= 0.5 else ():
                yield Plan(mix, "effect", (name,), r, "lean")
    elif mix == "outside":
        for name, r in product(OUTSIDE, (1.0, 2.0)):
            yield Plan(mix, "outside", (name,), r, "rich")
    elif mix == "withheld":
        # Which of the two was there is not to be seen from outside.
        for name, other in product(effects_on("rich"), repeat=2):
            if other != name:
                both = tuple(sorted((name, other)))
                yield Plan(mix, "effect", (name,), 1.0, "rich", withheld=both)
    else:
        for loading in ("ramp", "rates", "holds", "angles", "fleet"):
            for name in effects_on(loading):
                yield Plan(mix, "effect", (name,), 1.0, loading)


def _expected(rng: np.random.Generator) -> Plan:
    """Draw a plan with none ½, unknown 1/10, pairs 3 % and effects for the rest."""
    loading = str(rng.choice(["rich", "lean"]))
    serial, r = bool(rng.uniform() < _SERIAL), float(rng.choice(SIZES))
    kinds: tuple[CaseKind, ...] = ("null", "outside", "pair", "effect")
    kind = kinds[rng.choice(4, p=[0.5, 0.1, 0.03, 0.37])]
    if kind == "null":
        return Plan("prior", kind, (), 0.0, loading, serial)
    truth = ("",) * (2 if kind == "pair" else 1)
    plan = Plan("prior", kind, truth, r, loading, serial)
    return other_truth(plan, effects_on(loading), rng, noises=kind == "effect")


@cache
def effects_on(name: str) -> tuple[str, ...]:
    """Return the library's effects that a loading of `LOADINGS` can show."""
    return effects_shown(LOADINGS[name]())


def effects_shown(loading: Loading) -> tuple[str, ...]:
    """Return the library's effects that a loading can show."""
    features = loading.features
    mean = [name for name, each in MECHANISMS.items() if not each.needs - features]
    return (*mean, *NOISES)


def other_truth(
    plan: Plan,
    effects: tuple[str, ...],
    rng: np.random.Generator,
    *,
    noises: bool = False,
) -> Plan:
    """Return the plan with other mechanisms drawn, as many as it has.

    Args:
        plan: the plan.
        effects: that its loading can show.
        rng: of the draw.
        noises: whether effects of the noise may be drawn too.
    """
    names = tuple(OUTSIDE) if plan.kind == "outside" else effects
    if not noises:
        names = tuple(n for n in names if n not in NOISES)
    decoys = {*plan.withheld} - {*plan.truth}
    names = tuple(name for name in names if name not in decoys)
    chosen = rng.choice(names, len(plan.truth), replace=False)
    truth = tuple(sorted(map(str, chosen)))
    withheld = tuple(sorted({*decoys, *truth})) if plan.withheld else ()
    return replace(plan, truth=truth, withheld=withheld)
