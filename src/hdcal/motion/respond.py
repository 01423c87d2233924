"""Response of a calibrated gear to a force over time, with credible bands.

Of a gear that was calibrated at rest the data determine the stiffness only; mass and
damping are drawn from their priors, which the result states.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import jax
import numpy as np
import pandas as pd

from hdcal.data.case import require_force
from hdcal.data.plausible import implausible
from hdcal.errors import Finding, Findings
from hdcal.inference.distributions import sample_prior
from hdcal.inference.force_model.priors import without_scatter
from hdcal.inference.force_model.problem import case_reading
from hdcal.motion.dynamic_problem import mass_prior
from hdcal.motion.gears_in_motion import integrate_all, moving_draws
from hdcal.motion.response import Estimate, Estimates, Response
from hdcal.physics.dynamics import Forcing, damping_ratio, natural_frequency
from hdcal.prediction import conditions
from hdcal.prediction.joint import JointModel, joint
from hdcal.prediction.models import Models, averaging_words
from hdcal.report.item import TAILS, Interval

# A step, or times [s] and forces [N].
Force = str | tuple[Sequence[float] | np.ndarray, Sequence[float] | np.ndarray]
STEP, _DURATION = "step", 0.5
# A longer motion takes minutes, and its band says nothing new.
_MOST_SWINGS = 20_000
# Points whose quantiles are computed together.
_POINTS = 10_000
_COLUMNS = tuple(f"deformation_{end}_mm" for end in ("lo", "median", "hi"))


def respond(
    models: Models,
    force: Force,
    *,
    amplitude: float = 80.0,
    duration: float | None = None,
    temperature: float | None = None,
    mass: float | None = None,
    damping: float | None = None,
    points: int = 1001,
    draws: int = 500,
    seed: int = 0,
) -> Response:
    """Predict the deformation over time under a force on the gear.

    The motion begins at rest, from the unloaded gear.

    Args:
        models: from `calibrate`, `diagnose` or `calibrate_dynamic`.
        force: `step`, or a pair of times [s] and forces [N], linear between them.
        amplitude: of a step, of either sign [N].
        duration: of a step [s]; 0.5 by default.
        temperature: [°C]; by default the tested one nearest to the reference.
        mass: moved mass, if known [N·s²/mm]; 1 kg = 1e-3 N·s²/mm.
        damping: c, if known [N·s/mm].
        points: number of times.
        draws: gears integrated, at most those of the posterior.
        seed: of the draws of mass and damping from their priors.

    Raises:
        NotUsable: the posterior failed its checks, or a motion could not be
            integrated.
        InputError: a setting is out of range.
    """
    gears, given = joint(models), {"mass": mass, "damping": damping}
    case, dynamic = gears.posterior.case, gears.posterior.kind == "dynamic"
    require_force(case, "respond")
    at = conditions.usual_temperature(case) if temperature is None else temperature
    with Findings() as wrong:
        wrong += _force_findings(force, amplitude, duration, points)
        levels = np.array([at])
        wrong += conditions.temperature_findings(case.gear, gears.draws, levels)
        wrong += implausible("draws", draws, "gears") + implausible("seed", seed)
        wrong += _given_findings(given, dynamic)
    drive, times, words = _driven(force, amplitude, duration, points)
    values = moving_draws(joint(models, draws), seed)
    m, c, k = _coefficients(gears, values, at, given, seed)
    _check_reach(case.gear.reach, drive, times, m, k)
    deformation, peak = integrate_all(
        gears, values, m, c, force=drive, times=times, temperature=at
    )
    motion = _motion(gears, at, drive, times, deformation)
    effects = without_scatter(gears.effects)
    fitted = None if dynamic else gears.problem.discrepancy
    return Response(
        units=case.units,
        gear=case.gear.name,
        calibration="moving" if dynamic else "at rest",
        force=words,
        temperature_C=at,
        estimates=_estimates(gears, given, m, c, k, peak),
        tested_share=motion.tested.mean(),
        effects=tuple(e.name for e in effects if e.instantaneous),
        left_out=tuple(
            e.name for e in effects if not e.instantaneous and e.stage != "noise"
        ),
        draws=len(m),
        points=points,
        motion=motion,
        posterior=gears.posterior,
        looped=fitted is not None and fitted.looped,
        averaging=tuple(averaging_words(models)),
    )


def _driven(
    force: Force, amplitude: float, duration: float | None, points: int
) -> tuple[Forcing, np.ndarray, str]:
    """Return the force over time, the times [s] and the force in words."""
    if isinstance(force, str):
        drive = Forcing(np.zeros(1), np.full(1, float(amplitude)))
        times = np.linspace(0.0, duration or _DURATION, points)
        return drive, times, f"a step of {amplitude:g} N"
    drive = Forcing(*(np.asarray(part, float) for part in force))
    words = f"a sampled force of {len(drive.time)} rows, linear between them"
    return drive, np.linspace(drive.time[0], drive.time[-1], points), words


def _motion(
    gears: JointModel, at: float, drive: Forcing, times: np.ndarray, deformation
) -> pd.DataFrame:
    """Return force and band of the deformation, of draws (draw, time) [mm]."""
    # Quantiles are computed of a copy: part by part it takes little memory.
    parts = np.array_split(deformation, -(-len(times) // _POINTS), axis=1)
    band = np.concatenate([np.quantile(p, TAILS, axis=0) for p in parts], axis=1)
    return pd.DataFrame(
        {
            "time_s": times,
            "force_N": jax.vmap(drive)(times),
            **dict(zip(_COLUMNS, band, strict=True)),
            "tested": _tested(gears, at, band[0], band[2]),
        }
    )


def _given_findings(given, dynamic: bool) -> Iterator[Finding]:
    for name, value in given.items():
        yield from implausible(name, value)
        if dynamic and value is not None:
            words = "is determined by the dynamic calibration"
            yield Finding(name, words, "Leave it out")


def _force_findings(
    force: Force, amplitude: float, duration: float | None, points: int
) -> Iterator[Finding]:
    yield from implausible("points", points)
    if isinstance(force, str):
        yield from implausible("amplitude", amplitude)
        yield from implausible("duration", duration)
        if amplitude == 0.0:
            yield Finding("amplitude", "is 0", "Give a force in N")
        if force != STEP:
            words = f"'{force}' is not a known force"
            yield Finding("force", words, f"Use {STEP} or a table")
        return
    if duration is not None:
        words = "is for a step only; the table states the times"
        yield Finding("duration", words, "Leave it out")
    times, forces, words = *(np.asarray(part, float) for part in force), ""
    if times.shape != forces.shape or times.ndim != 1 or len(times) < 2:
        words = "needs the same number of times and forces, two or more"
    elif wrong := implausible("force", forces) + implausible("force", times, "time"):
        words = f"the table contains {wrong[0].problem}"
    elif np.any(np.diff(times) <= 0.0):
        words = "has times that do not increase"
    elif not np.any(forces):
        words = "is zero throughout"
    if words:
        yield Finding("force", words, "Correct the table")


def _coefficients(gears: JointModel, values, at: float, given, seed: int):
    """Return mass, damping and stiffness of each draw at a temperature [°C]."""
    case, count = gears.posterior.case, len(values["K"])
    k = values["stiffness"]
    k = k * (1.0 - values["alpha"] * (at - case.gear.reference_temperature))
    if gears.posterior.kind == "dynamic":
        m, ratio = values["mass"], values["damping_ratio"]
        return m, 2.0 * ratio * np.sqrt(k * m), k
    rng, m, c = np.random.default_rng(seed), given["mass"], given["damping"]
    if m is None:
        prior = mass_prior(case.gear, case_reading(case).radial_per_read)
        m = sample_prior(prior, "mass", rng, count)
    if c is None:
        prior = case.gear.dynamic_priors["damping_ratio"]
        ratio = sample_prior(prior, "damping_ratio", rng, count)
        c = 2.0 * ratio * np.sqrt(k * m)
    return np.full(count, m), np.full(count, c), k


def _check_reach(reach: float, drive: Forcing, times, m, k) -> None:
    """Refuse a wrong unit: a force that folds the gear, or a motion of hours."""
    with Findings() as wrong:
        static = float(drive.largest) / np.median(k)
        if static >= reach:
            words = f"would deform the gear by {static:.3g} mm even statically"
            wrong.append(Finding("force", words, "Give the force in N"))
        seconds = float(np.ptp(times))
        swings = seconds * float(np.max(natural_frequency(m, k)))
        if swings > _MOST_SWINGS:
            words = f"{seconds:g} s are up to {swings:.2g} periods of the vibration"
            remedy = f"Use at most {_MOST_SWINGS:g} periods, and give times in s"
            wrong.append(Finding("duration", words, remedy))


def _tested(gears: JointModel, temperature: float, low, high) -> np.ndarray:
    """Return where the deformation of a band [mm] and a temperature were tested."""
    records, slack = gears.posterior.case.records, conditions.NEAR_MM
    # Motion begins at the unloaded gear.
    offset = np.median(gears.draws["deformation_offset"])
    reached = np.append(records.deformation - offset, 0.0)
    inside = (low >= reached.min() - slack) & (high <= reached.max() + slack)
    return inside & conditions.temperature_is_tested(records, temperature)


def _estimates(gears: JointModel, given, m, c, k, peak) -> Estimates:
    """Return the quantities, and what determines them."""
    by: dict[str, Any] = {"k": gears.driver("K"), "m": gears.driver("mass")}
    by["c"] = gears.driver("damping_ratio")
    known = {"m": given["mass"], "c": given["damping"]}
    by |= {name: "given" for name, value in known.items() if value is not None}
    frequency, ratio = natural_frequency(m, k), damping_ratio(m, c, k)
    damped = frequency * np.sqrt(np.maximum(1.0 - ratio**2, 0.0))

    def estimate(draws, parts: str) -> Estimate:
        drivers = [by[part] for part in parts]
        driver: Any = next(d for d in ("prior", "data", "given") if d in drivers)
        return Estimate(**Interval.of(draws).model_dump(), driven_by=driver)

    return Estimates(
        natural_frequency_Hz=estimate(frequency, "mk"),
        damped_frequency_Hz=estimate(damped, "mck"),
        damping_ratio=estimate(ratio, "mck"),
        damping_N_s_per_mm=estimate(c, "c"),
        mass_kg=estimate(1e3 * m, "m"),
        stiffness_N_per_mm=estimate(k, "k"),
        peak_mm=estimate(peak, "mck"),
    )
