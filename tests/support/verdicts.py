"""Make-believe verdicts, one of each kind, for whatever shows a verdict."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from rigs import cycles, make_case, make_records

from hdcal.data.case import Case
from hdcal.diagnosis.budget import Budget, BudgetPart
from hdcal.diagnosis.gap import Cell, CovariateShare, Gap, Where
from hdcal.diagnosis.verdict import (
    Amplitude,
    Closure,
    LadderEntry,
    NextRun,
    NotTestable,
    Verdict,
    Which,
)
from hdcal.diagnosis.where import about
from hdcal.report.intervals import Interval

NOISE = 0.3
CLOSED = Interval(0.91, 0.85, 0.95)
NAN = float("nan")
LIBRARY = ("coulomb_friction", "hysteresis", "ovality", "progressive_stiffening")


def _cell(covariate, label, start, stop, unit, rows, residual) -> Cell:
    count = int(np.count_nonzero(rows))
    error = NOISE / np.sqrt(count)
    bias = float(np.mean(residual[rows]))
    share = float(np.sum(residual[rows] ** 2) / np.sum(residual**2))
    z = bias / error
    span = about(bias, 3.2 * error)
    return Cell(covariate, label, start, stop, unit, count, span, z, share)


def _ranges(name, values, residual, count, unit):
    edges = np.linspace(values.min(), values.max(), count + 1)
    for i, (low, high) in enumerate(pairwise(edges)):
        last = values <= high if i == count - 1 else values < high
        label = f"{low:.3g} … {high:.3g} {unit}"
        rows = (values >= low) & last
        yield _cell(name, label, float(low), float(high), unit, rows, residual)


def _cells(case: Case, residual) -> tuple[Cell, ...]:
    records = case.records
    cells = [*_ranges("deformation", records.deformation, residual, 6, "mm")]
    if "temperature" in records.known:
        for level in np.unique(records.temperature):
            here = records.temperature == level
            ends = (float(level), float(level), "°C")
            cells.append(_cell("temperature", f"{level:g} °C", *ends, here, residual))
    if "time" in records.known:
        cells += _ranges("time", records.time, residual, 4, "s")
    if "unloading" in records.known:
        for word, sense in (("loading", 1), ("unloading", -1)):
            here = records.sense == sense
            cells.append(_cell("direction", word, NAN, NAN, "", here, residual))
            for part in _ranges("", records.deformation, residual, 3, "mm"):
                rows = here & (records.deformation >= part.from_)
                rows &= records.deformation <= part.to
                words = f"{word}, {part.label}"
                product = "direction × deformation"
                cells.append(_cell(product, words, NAN, NAN, "", rows, residual))
    return tuple(cells)


def _verdict(case: Case, gap, which: Which, shrink: Closure, **other) -> Verdict:
    noise = np.random.default_rng(3).normal(0.0, NOISE, len(gap))
    size = float(np.sqrt(np.mean(gap**2)))
    found = which.verdict != "none"
    chance = 1.0 - which.probabilities["none"]
    rms = Interval(size, 0.9 * size, 1.1 * size) if found else Interval(NAN, NAN, NAN)
    shares = (
        CovariateShare("deformation", Interval(0.7, 0.6, 0.8)),
        CovariateShare("direction", Interval(0.25, 0.2, 0.3)),
    )
    runs = other.pop("next_test", ())
    return Verdict(
        case=case,
        gap=Gap(found, chance, rms, NOISE, rms.median / 110.0, 0.1),
        where=Where(
            p_value=0.0004 if found else 0.41,
            statistics={"cells": 11.2 if found else 1.9, "lag": 0.8},
            cells=_cells(case, gap + noise),
            shares=shares if found else (),
            residual_N=gap + noise,
            gap_N=gap,
            records=case.records,
        ),
        which=which,
        shrink=shrink,
        next_test=runs,
        no_run="" if runs else "no run would tell more",
        budget=_budget(),
        posteriors={},
        library=LIBRARY,
        notes=("every second row was left out",),
        **other,
    )


def _budget() -> Budget:
    parts = (
        BudgetPart(
            "diametral instead of radial deformation",
            Interval(1.02, 0.5, 2.0),
            Interval(1.0, 0.5, 2.0),
            "prior",
            "measure the deformation on both sides",
        ),
        BudgetPart(
            "wall thickness",
            Interval(1.3, 1.1, 1.5),
            Interval(1.0, 0.8, 1.25),
            "data",
            "measure the wall at six places",
        ),
    )
    K = Interval(1.87, 1.85, 1.89)
    return Budget(K, "ring", parts, "One curve gives the product only.")


def _which(verdict, probabilities, **other) -> Which:
    names = {part for name in probabilities for part in name.split("+")}
    effects = sorted(names - {"none", "unknown"})
    inclusion = {
        effect: sum(p for name, p in probabilities.items() if effect in name.split("+"))
        for effect in effects
    }
    standard = {
        "effect": None,
        "second_effect": None,
        "set": (),
        "amplitude": None,
        "not_testable": (NotTestable("ovality", ("angle",)),),
        "not_excited": (),
        "inseparable": (),
        "sensitivity": {"wide": 0.95, "narrow": 0.93},
        "stability": 0.97,
    }
    evidence = {n: float(np.log(p / 0.01)) for n, p in probabilities.items()}
    return Which(
        verdict=verdict,
        probabilities=probabilities,
        inclusion=inclusion,
        log_evidence=evidence,
        **{**standard, **other},
    )


def _shrink(*effects: str, size=3.0, closed=CLOSED) -> Closure:
    name = "+".join(["calibrated", *effects])
    rungs = [("nominal", 41.0), ("calibrated", size), ("noise", NOISE)]
    rungs[2:2] = [(name, 0.45)] if effects else []
    rungs[-1:-1] = [(f"{name}+remainder", 0.32)]
    return Closure(
        ladder=tuple(LadderEntry(*rung) for rung in rungs),
        closed=closed,
        held_out="leave-one-half-cycle-out",
        extrapolated_closed=0.78,
        placebo_closed=0.4,
        remainder_N=Interval(0.2, 0.1, 0.4),
        reason="",
        bars={effect: 0.9 - 0.1 * i for i, effect in enumerate(effects)},
    )


def named() -> Verdict:
    """A loop: unloading lags behind loading, most in the middle."""
    case = make_case(cycles(180))
    records = case.records
    depth = records.deformation / 0.54
    gap = 3.1 * depth**4 - 2.2 * (records.sense < 0) * depth * (1 - depth) * 4
    rest = {"coulomb_friction+hysteresis": 0.02, "coulomb_friction": 0.01}
    chances = {"hysteresis": 0.94, **rest, "unknown": 0.02, "none": 0.01}
    size = 0.045, 0.040, 0.051
    which = _which(
        "named",
        chances,
        effect="hysteresis",
        set=("hysteresis",),
        amplitude=Amplitude(*size, "hysteresis", "hysteresis.loop_width", "mm"),
        inseparable=(
            *(("seating_slack", f"other_{i}") for i in range(5)),
            ("coulomb_friction", "hysteresis"),
        ),
    )
    runs = (
        NextRun(
            "unload at the same rate",
            ("hysteresis", "coulomb_friction"),
            0.69,
            "a ramp",
        ),
        NextRun("repeat at 60 °C", ("hysteresis",), 0.1, "an oven and a day"),
    )
    return _verdict(case, gap, which, _shrink("hysteresis"), next_test=runs)


def none() -> Verdict:
    """Nothing but noise."""
    case = make_case(cycles(48))
    which = _which(
        "none",
        {"none": 0.93, "hysteresis": 0.03, "unknown": 0.04},
        set=("none",),
        not_excited=("progressive_stiffening",),
    )
    shrink = _shrink(size=0.31, closed=None)
    shrink = replace(
        shrink,
        ladder=(
            LadderEntry("nominal", 41.0),
            LadderEntry("calibrated", 0.31),
            LadderEntry("noise", NOISE),
        ),
        reason="no gap is detected, so that there is nothing to close",
        extrapolated_closed=None,
        placebo_closed=None,
        remainder_N=None,
    )
    return _verdict(case, np.zeros(48), which, shrink)


def ambiguous() -> Verdict:
    """Fourteen rows of one ramp that bends: two effects could do that."""
    case = make_case(make_records(np.linspace(0.02, 0.54, 14)))
    x = np.linspace(-1.0, 1.0, 14)
    which = _which(
        "ambiguous",
        {
            "progressive_stiffening": 0.55,
            "seating_slack": 0.38,
            "unknown": 0.05,
            "none": 0.02,
        },
        effect="progressive_stiffening",
        set=("progressive_stiffening", "seating_slack"),
        not_testable=(
            NotTestable("coulomb_friction", ("unloading",)),
            NotTestable("charge_leakage", ("holds", "time")),
        ),
        stability=0.6,
    )
    shrink = replace(
        _shrink("progressive_stiffening", size=1.4),
        bars={"progressive_stiffening": 0.7, "seating_slack": 0.66},
        closed=Interval(0.7, 0.2, 0.9),
        held_out="leave-one-block-out",
        extrapolated_closed=-0.3,
    )
    pair = ("progressive_stiffening", "seating_slack")
    run = NextRun("take ten finer steps below 0.1 mm", pair, 0.5, "one ramp")
    return _verdict(case, 3.0 * (x**2 - 0.4), which, shrink, next_test=(run,))


def unknown() -> Verdict:
    """A shape that no effect of the library has."""
    case = make_case(cycles(180))
    gap = 1.5 * np.sin(25.0 * case.records.deformation)
    chances = {"unknown": 0.93, "hysteresis": 0.05, "none": 0.02}
    which = _which("unknown", chances, set=("unknown",), stability=None)
    shrink = replace(_shrink(size=1.1, closed=None), reason="no effect is named")
    return _verdict(case, gap, which, shrink)


def failed() -> Verdict:
    """As the named one, but nothing of it may be used."""
    reasons = ("R-hat: 1.2 for hysteresis.loop_width",)
    return replace(named(), reasons=reasons)


KINDS = {
    "named": named,
    "none": none,
    "ambiguous": ambiguous,
    "unknown": unknown,
    "failed": failed,
}
