"""The cases of a blind check: each plan simulated on a rig drawn for it."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from benchmarks.blind.label import Label
from benchmarks.blind.mixes import (
    MIXES,
    TIME_CONSTANTS,
    Plan,
    draw_plans,
    other_truth,
)
from benchmarks.blind.rig.history import Floats
from benchmarks.blind.rig.loadings import (
    LOADINGS,
    POINTS,
    Loading,
    Writing,
    draw_writing,
    rich,
)
from benchmarks.blind.rig.mechanisms import MECHANISMS
from benchmarks.blind.rig.noise import NOISES
from benchmarks.blind.rig.outside import OUTSIDE
from benchmarks.blind.rig.virtual_rig import VirtualRig, draw_noise, draw_rig
from hdcal.errors import Finding, InputError

# Rigs of many sizes have no drawing; the material is the same.
GEAR_TOML = """\
[gear]
name = "blind check"
theory = "spring"
material = "40CrNiMoA"

[measurement]
deformation = "radial"
reference_temperature_C = 20.0
"""
_TRIES = 20
# A mechanism outside the library that calibration absorbs for the most part is a wrong
# stiffness, not a gap: least RMS that has to be left.
_LEAST_LEFT = 0.2


def draw_cases(mix: str, count: int, seed: int) -> Iterator[tuple[str, Label]]:
    """Yield the measurement file and the label of cases in random order.

    Args:
        mix: one of `MIXES`.
        count: number of cases.
        seed: of all random numbers.

    Raises:
        InputError: an argument is out of range.
    """
    if mix not in MIXES or count < 1 or seed < 0:
        words = f"no set of {count} cases of the mix '{mix}' (seed {seed}) can be drawn"
        remedy = f"Give one of the mixes {', '.join(MIXES)}, cases ≥ 1 and a seed ≥ 0"
        raise InputError([Finding("make", words, remedy)])
    rng = np.random.default_rng(seed)
    digits = len(str(count))
    for number, plan in enumerate(draw_plans(mix, count, rng), start=1):
        yield _case(f"case-{number:0{digits}}", plan, rng.spawn(1)[0])


def _case(name: str, plan: Plan, rng: np.random.Generator) -> tuple[str, Label]:
    loading = LOADINGS[plan.loading]() if plan.points == POINTS else rich(plan.points)
    for _ in range(_TRIES):
        for _ in range(_TRIES):
            rig = draw_rig(loading.history, rng)
            curve = _drawn_curve(plan, rig, rng)
            if curve is not None:
                return _read(name, plan, loading, rig, curve, rng)
        # No plausible rig shows this at this size: take another effect instead.
        plan = other_truth(plan, rng)
    raise RuntimeError(f"the loading {loading.name} shows nothing of size {plan.r:g}")


def _drawn_curve(
    plan: Plan, rig: VirtualRig, rng: np.random.Generator
) -> Floats | None:
    """Return what the mechanisms add [N].

    Returns:
        None where this rig does not show a drawn mechanism at the size of the plan.
    """
    if plan.kind == "outside":
        return _outside_curve(plan.truth[0], plan.r, rig, rng)
    outside = np.zeros(len(rig.history.order))
    if plan.outside:
        r = plan.r * np.sqrt(1.0 - plan.share)
        outside = _outside_curve(plan.outside, r, rig, rng)
        if outside is None:
            return None
    active = []
    for name in plan.truth:
        if name in NOISES:
            continue
        r = plan.r * np.sqrt(plan.share)
        sized = rig.draw_mechanism(MECHANISMS[name], r, rng)
        if sized is None:
            return None
        active.append(sized)
    return rig.readings(active) - rig.fault_free + outside


def _outside_curve(
    name: str, r: float, rig: VirtualRig, rng: np.random.Generator
) -> Floats | None:
    """Return what an outside mechanism adds [N], None where it is absorbed."""
    history = replace(rig.history, force=rig.fault_free)
    curve = OUTSIDE[name](history, rng)
    size = rig.gap_over_noise(curve)
    if size == 0.0 or size * rig.sigma < _LEAST_LEFT * np.sqrt(np.mean(curve**2)):
        return None
    return rng.choice([-1.0, 1.0]) * r / size * curve


def _read(
    name: str,
    plan: Plan,
    loading: Loading,
    rig: VirtualRig,
    curve: Floats,
    rng: np.random.Generator,
) -> tuple[str, Label]:
    """Return the measurement file and the label of one case."""
    correlation = _correlation(plan, rng)
    clean = rig.fault_free + curve
    reading = clean + draw_noise(rig, rng, correlation)
    for each in plan.truth:
        if each in NOISES:
            reading = reading + NOISES[each](reading, plan.r * rig.sigma, rng)
    writing = draw_writing(rng)
    label = Label(
        case=name,
        kind=plan.kind,
        truth=plan.truth,
        program=loading.name,
        rows=len(reading),
        r=plan.r,
        noise=plan.noise,
        correlation=correlation,
        sigma=rig.sigma * writing.force,
        withheld=plan.withheld,
        clean=_rounded(clean, writing),
        curve=_rounded(rig.gap(curve), writing),
        outside=plan.outside,
        share=plan.share,
    )
    return loading.csv(reading, writing), label


def _correlation(plan: Plan, rng: np.random.Generator) -> float:
    """Draw the AR(1) coefficient of the noise."""
    if plan.noise == "iid":
        return 0.0
    if plan.noise == "ar":
        return float(rng.uniform(0.1, 0.5))
    rows = plan.points * rng.uniform(*TIME_CONSTANTS[plan.noise])
    return float(np.exp(-1.0 / rows))


def _rounded(values: Floats, writing: Writing) -> tuple[float, ...]:
    return tuple((np.round(values, 5) * writing.force).tolist())
