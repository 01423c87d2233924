"""The cases of a blind check: each plan carried out on a rig of its own."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from hdcal.blind.label import Label
from hdcal.blind.virtual_rig.history import Floats
from hdcal.blind.virtual_rig.loadings import LOADINGS, POINTS, Loading, rich
from hdcal.blind.virtual_rig.mixes import (
    OUTSIDE,
    RIGS,
    TIME_CONSTANTS,
    Plan,
    draw_plans,
    effects_shown,
    other_truth,
)
from hdcal.blind.virtual_rig.oracle import oracle_probabilities
from hdcal.blind.virtual_rig.outside import LISTED
from hdcal.blind.virtual_rig.sensing import NOISES
from hdcal.blind.virtual_rig.virtual_rig import (
    MECHANISMS,
    VirtualRig,
    draw_noise,
    draw_rig,
)
from hdcal.blind.virtual_rig.writing import AS_SIMULATED, Writing, draw_writing
from hdcal.data.plausible import implausible
from hdcal.errors import Finding, Findings, InputError

# Rigs of many sizes have no drawing; the material is that of the others.
RIGS_TOML = """\
[gear]
name = "blind check"
theory = "spring"
material = "40CrNiMoA"

[measurement]
deformation = "radial"
reference_temperature_C = 20.0
"""
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
_TRIES = 20
# An outside mechanism that calibration absorbs for the most part is a wrong K, no gap.
_LEAST_LEFT = 0.2


def draw_cases(
    mix: str, count: int, seed: int, loading: Loading | None = None
) -> Iterator[tuple[str, Label]]:
    """Make cases in random order, named by their number.

    Args:
        mix: one of `MIXES`.
        count: of cases.
        seed: of all random numbers.
        loading: that every case goes through, instead of those of the mix; effects
            that it cannot show are replaced by others.

    Yields:
        The measurement file and the label of each.

    Raises:
        InputError: no mix has this name, or a loading shows next to nothing, or the
            count or the seed is none.
    """
    with Findings() as wrong:
        wrong += implausible("cases", count) + implausible("seed", seed, "secret_seed")
    rng = np.random.default_rng(seed)
    digits = len(str(count))
    for number, plan in enumerate(draw_plans(mix, count, rng), start=1):
        own, name = rng.spawn(1)[0], f"case-{number:0{digits}}"
        if loading is not None:
            plan = _on(loading, plan, own)
        yield _case(name, plan, loading or _loading(plan), own)


def gear_file(mix: str) -> str:
    """Return the gear file of the cases of a mix."""
    return RIGS_TOML if mix == RIGS else GEAR_TOML


def _loading(plan: Plan) -> Loading:
    if plan.points == POINTS:
        return LOADINGS[plan.loading]()
    made = rich(plan.points)
    return replace(made, name=f"{made.name}-{len(made.history.order)}")


def _on(loading: Loading, plan: Plan, rng: np.random.Generator) -> Plan:
    """Return the plan for another loading than its own."""
    plan = replace(plan, loading=loading.name)
    shown = effects_shown(loading)
    if plan.kind == "outside" or {*plan.truth} <= {*shown}:
        return plan
    return other_truth(plan, shown, rng)


def _case(
    name: str, plan: Plan, loading: Loading, rng: np.random.Generator
) -> tuple[str, Label]:
    for _ in range(_TRIES):
        for _ in range(_TRIES):
            rig = draw_rig(loading.history, rng)
            drawn = _drawn_curve(plan, rig, rng)
            if drawn is not None:
                return _read(name, plan, loading, rig, *drawn, rng)
        # No plausible rig shows this at this size: take another effect instead.
        plan = other_truth(plan, effects_shown(loading), rng)
    words = f"shows next to nothing of size r = {plan.r:g}"
    remedy = "Name a program with more rows, or that varies more"
    raise InputError([Finding(f"program '{loading.name}'", words, remedy)])


def _drawn_curve(
    plan: Plan, rig: VirtualRig, rng: np.random.Generator
) -> tuple[Floats, dict[str, float]] | None:
    """Return what the mechanisms add [N] and their true amplitudes.

    Returns:
        None where this rig does not show a drawn mechanism at the size of the plan.
    """
    if plan.kind == "outside":
        curve = _outside_curve(plan.truth[0], plan.r, rig, rng)
        return None if curve is None else (curve, {})
    other = np.zeros(len(rig.history.order))
    if plan.beside:
        r = plan.r * np.sqrt(1.0 - plan.share)
        other = _outside_curve(plan.beside, r, rig, rng)
        if other is None:
            return None
    active, amplitude = [], {}
    for name in plan.truth:
        if name in NOISES:
            continue
        found = rig.draw_mechanism(name, plan.r * np.sqrt(plan.share), rng)
        if found is None:
            return None
        active.append(found)
        if MECHANISMS[name].amplitude:
            amplitude[MECHANISMS[name].amplitude] = found.size
    return rig.readings(active) - rig.fault_free + other, amplitude


def _outside_curve(
    name: str, r: float, rig: VirtualRig, rng: np.random.Generator
) -> Floats | None:
    """Return what a mechanism of no library adds [N], None where nothing is left."""
    history = replace(rig.history, force=rig.fault_free)
    curve = OUTSIDE[name](history, rng)
    own = float(rig.gap_over_noise(curve))
    if own == 0.0 or own * rig.sigma < _LEAST_LEFT * np.sqrt(np.mean(curve**2)):
        return None
    return rng.choice([-1.0, 1.0]) * r / own * curve


def _read(
    name: str,
    plan: Plan,
    loading: Loading,
    rig: VirtualRig,
    curve: Floats,
    amplitude: dict[str, float],
    rng: np.random.Generator,
) -> tuple[str, Label]:
    """Return the measurement file and the label of one case."""
    correlation = _correlation(plan, rng)
    clean = rig.fault_free + curve
    reading = clean + draw_noise(rig, rng, correlation)
    for each in plan.truth:
        if each in NOISES:
            reading = reading + NOISES[each](reading, plan.r * rig.sigma, rng)
    writing = draw_writing(rng) if plan.mix == RIGS else AS_SIMULATED
    label = Label(
        case=name,
        mix=plan.mix,
        kind=plan.kind,
        truth=plan.truth,
        program=loading.name,
        rows=len(reading),
        r=plan.r,
        noise="ar" if plan.noise == "strong" else plan.noise,
        correlation=correlation,
        sigma=rig.sigma * writing.force,
        spanned=plan.truth[0] in LISTED if plan.kind == "outside" else None,
        withheld=plan.withheld,
        clean=_rounded(clean, writing),
        curve=_rounded(rig.gap(curve), writing),
        # Each has a unit of its own, which goes with the scale.
        amplitude={} if plan.mix == RIGS else amplitude,
        oracle=_oracle(plan, loading, rig, reading, curve, correlation),
        beside=plan.beside,
        share=plan.share,
    )
    return loading.csv(reading, writing), label


def _oracle(
    plan: Plan,
    loading: Loading,
    rig: VirtualRig,
    reading: Floats,
    curve: Floats,
    correlation: float,
) -> dict[str, float]:
    """Return the oracle's probabilities, where there is one effect for it to find."""
    on_mean = plan.kind == "effect" and plan.truth[0] not in NOISES
    as_simulated = plan.loading in LOADINGS and plan.points == POINTS
    if not on_mean or plan.withheld or not as_simulated:
        return {}
    return oracle_probabilities(
        loading,
        rig,
        reading,
        truth=plan.truth[0],
        curve=curve,
        r=plan.r,
        correlation=correlation,
    )


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
