"""Which cases a blind check is made of, and how each of them is made."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice, product

import numpy as np

from hdcal.blind.label import Kind, Label
from hdcal.blind.virtual_rig.loadings import PROGRAMS, Program
from hdcal.blind.virtual_rig.oracle import judge
from hdcal.blind.virtual_rig.outside import CHOSEN, LISTED, UNSEEN
from hdcal.blind.virtual_rig.sensing import NOISES
from hdcal.blind.virtual_rig.virtual_rig import (
    MECHANISMS,
    Bench,
    draw_bench,
    draw_noise,
)
from hdcal.errors import Finding, InputError

# Material and geometry are those that the rigs are drawn about.
GEAR_TOML = """\
[gear]
name = "blind check"
wall_thickness_mm = 0.68
radius_mm = 40.0
length_mm = 70.0
material = "40CrNiMoA"

[measurement]
deformation = "radial"
reference_temperature_C = 20.0
"""
SIZES = (0.2, 0.3, 0.5, 1.0, 2.0, 5.0)
_OTHERS = ("ramp", "rates", "holds", "angles", "fleet")
_OUTSIDE = {**LISTED, **CHOSEN, **UNSEEN}
_TRIES = 20
# Share of cases whose noise is serially correlated.
_SERIAL = 0.25
# An outside mechanism that the base absorbs for the most part is a wrong K, no gap.
_LEAST_LEFT = 0.2

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
    """What one case shall be."""

    mix: str
    kind: Kind
    names: tuple[str, ...]
    r: float
    program: str
    serial: bool
    withheld: tuple[str, ...] = ()


def draw_cases(
    mix: str, count: int, seed: int, program: Program | None = None
) -> Iterator[tuple[str, Label]]:
    """Make cases in random order, named by their number.

    Args:
        mix: one of `MIXES`.
        count: of cases.
        seed: of all random numbers.
        program: that every case goes through, instead of those of the mix; effects
            that it cannot tell are replaced by others.

    Yields:
        The measurement file and the label of each.

    Raises:
        InputError: a program shows next to nothing.
    """
    rng = np.random.default_rng(seed)
    digits = len(str(count))
    for number, plan in enumerate(_plans(mix, count, rng), start=1):
        own, name = rng.spawn(1)[0], f"case-{number:0{digits}}"
        if program is None:
            yield _case(name, plan, PROGRAMS[plan.program](), own)
        else:
            yield _case(name, _on(program, plan, own), program, own)


def _plans(mix: str, count: int, rng: np.random.Generator) -> list[Plan]:
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
    design = list(_designed(mix))
    while True:
        for index in rng.permutation(len(design)):
            plan = design[index]
            serial = plan.serial if mix == "null" else bool(rng.uniform() < _SERIAL)
            yield replace(plan, serial=serial)


def _designed(mix: str) -> Iterator[Plan]:
    if mix == "null":
        programs = ("rich", "rich", "lean", "ramp", "fleet")
        for program, serial in product(programs, (False, True)):
            yield Plan(mix, "null", (), 0.0, program, serial)
    elif mix == "effects":
        for r in SIZES:
            for name in known_on("rich"):
                yield Plan(mix, "effect", (name,), r, "rich", False)
                # The sizes that the bar is about are looked at twice.
                if r in (0.5, 1.0):
                    yield Plan(mix, "effect", (name,), r, "rich", False)
            for name in known_on("lean") if r >= 0.5 else ():
                yield Plan(mix, "effect", (name,), r, "lean", False)
    elif mix == "outside":
        for name, r in product(_OUTSIDE, (1.0, 2.0)):
            yield Plan(mix, "outside", (name,), r, "rich", False)
    elif mix == "withheld":
        for name in known_on("rich"):
            # Which of the two was there is not to be seen from outside.
            for other in known_on("rich"):
                if other != name:
                    both = tuple(sorted((name, other)))
                    yield Plan(mix, "effect", (name,), 1.0, "rich", False, both)
    else:
        for program in _OTHERS:
            for name in known_on(program):
                yield Plan(mix, "effect", (name,), 1.0, program, False)


def _expected(rng: np.random.Generator) -> Plan:
    """Draw a plan with none ½, unknown 1/10, pairs 3 % and effects for the rest."""
    program = str(rng.choice(["rich", "lean"]))
    serial, r = bool(rng.uniform() < _SERIAL), float(rng.choice(SIZES))
    kinds: tuple[Kind, ...] = ("null", "outside", "pair", "effect")
    kind = kinds[rng.choice(4, p=[0.5, 0.1, 0.03, 0.37])]
    if kind == "null":
        return Plan("prior", kind, (), 0.0, program, serial)
    plan = Plan("prior", kind, ("",) * (2 if kind == "pair" else 1), r, program, serial)
    return _another(plan, PROGRAMS[program](), rng, noises=kind == "effect")


def known_on(program: str) -> tuple[str, ...]:
    """Return the library's effects that can be told on a program of that name."""
    return _told(PROGRAMS[program]())


def _told(program: Program) -> tuple[str, ...]:
    mean = [n for n, made in MECHANISMS.items() if not made.needs - program.features]
    return (*mean, *NOISES)


def _on(program: Program, plan: Plan, rng: np.random.Generator) -> Plan:
    """Return the plan for another program than its own."""
    plan = replace(plan, program=program.name)
    known = plan.kind == "outside" or not {*plan.names} - {*_told(program)}
    return plan if known else _another(plan, program, rng)


def _case(
    name: str, plan: Plan, program: Program, rng: np.random.Generator
) -> tuple[str, Label]:
    for _ in range(_TRIES):
        for _ in range(_TRIES):
            bench = draw_bench(program.history, rng)
            made = _switched_on(plan, bench, rng)
            if made is not None:
                return _written(name, plan, program, bench, made, rng)
        # No plausible rig shows this at this size: take another effect instead.
        plan = _another(plan, program, rng)
    words = f"shows next to nothing of size r = {plan.r:g}"
    remedy = "Name a program with more rows, or that varies more"
    raise InputError([Finding(f"program '{program.name}'", words, remedy)])


def _another(
    plan: Plan, program: Program, rng: np.random.Generator, *, noises: bool = False
) -> Plan:
    """Return the plan with other names, as many as it has."""
    names = tuple(_OUTSIDE) if plan.kind == "outside" else _told(program)
    if not noises:
        names = tuple(n for n in names if n not in NOISES)
    decoys = {*plan.withheld} - {*plan.names}
    names = tuple(name for name in names if name not in decoys)
    chosen = rng.choice(names, len(plan.names), replace=False)
    drawn = tuple(sorted(map(str, chosen)))
    withheld = tuple(sorted({*decoys, *drawn})) if plan.withheld else ()
    return replace(plan, names=drawn, withheld=withheld)


def _switched_on(plan: Plan, bench: Bench, rng) -> tuple[np.ndarray, dict] | None:
    """Return what the mechanisms add [N] and their true amplitudes."""
    clean, amplitude = bench.plain, {}
    if plan.kind == "outside":
        curve = _OUTSIDE[plan.names[0]](replace(bench.history, force=clean), rng)
        seen = float(bench.visible(curve))
        if seen == 0.0 or seen * bench.sigma < _LEAST_LEFT * np.sqrt(np.mean(curve**2)):
            return None
        return rng.choice([-1.0, 1.0]) * plan.r / seen * curve, {}
    switched = []
    for name in plan.names:
        if name in NOISES:
            continue
        found = bench.at_size(name, plan.r, rng)
        if found is None:
            return None
        switched.append(found)
        if MECHANISMS[name].amplitude:
            amplitude[MECHANISMS[name].amplitude] = found.size
    return bench.read(switched) - clean, amplitude


def _written(name, plan: Plan, program: Program, bench: Bench, made, rng):
    curve, amplitude = made
    correlation = float(rng.uniform(0.1, 0.5)) if plan.serial else 0.0
    clean = bench.plain + curve
    reading = clean + draw_noise(bench, rng, correlation)
    for each in plan.names:
        if each in NOISES:
            size = plan.r * bench.sigma
            reading = reading + NOISES[each](reading, size, rng)
    oracle = {}
    on_mean = plan.kind == "effect" and plan.names[0] not in NOISES
    if on_mean and not plan.withheld and plan.program in PROGRAMS:
        truth = {"truth": plan.names[0], "curve": curve, "r": plan.r}
        oracle = judge(program, bench, reading, correlation=correlation, **truth)
    label = Label(
        case=name,
        mix=plan.mix,
        kind=plan.kind,
        truth=plan.names,
        program=plan.program,
        rows=len(reading),
        r=plan.r,
        noise="ar" if plan.serial else "iid",
        correlation=correlation,
        sigma=bench.sigma,
        spanned=plan.names[0] in LISTED if plan.kind == "outside" else None,
        withheld=plan.withheld,
        clean=_rounded(clean),
        curve=_rounded(bench.left(curve)),
        amplitude=amplitude,
        oracle=oracle,
    )
    return program.csv(reading), label


def _rounded(values: np.ndarray) -> tuple[float, ...]:
    return tuple(np.round(values, 5).tolist())
