"""Response of a calibrated gear to a force over time, with credible bands.

Of a gear that was calibrated at rest the data determine the stiffness only; mass and
damping are drawn from their priors, which the result states.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import jax
import numpy as np
import pandas as pd
from pydantic import Field, InstanceOf, computed_field

from hdcal.data.case import require_force
from hdcal.data.plausible import implausible
from hdcal.errors import Finding, Findings
from hdcal.inference.distributions import sample_prior
from hdcal.inference.force_model.problem import case_reading
from hdcal.motion.charts import response_chart
from hdcal.motion.drive import Drive, Force, make_drive
from hdcal.motion.dynamic_problem import mass_prior
from hdcal.motion.gear_force import CalibratedGears, Models
from hdcal.motion.integration import integrate_all
from hdcal.physics.dynamics import acting, damping_ratio, natural_frequency
from hdcal.report.charts.chart_spec import Chart
from hdcal.report.item import INTERVAL, TAILS, Count, Interval, Item, Words, quantity
from hdcal.report.provenance import gear_rows
from hdcal.report.result import Result

Driver = Literal["data", "prior", "given"]
# A longer motion takes minutes, and its band says nothing new.
_MOST_SWINGS = 20_000
# Points whose quantiles are computed together.
_POINTS = 10_000
_COLUMNS = tuple(f"deformation_{end}_mm" for end in ("lo", "median", "hi"))
_BAND = (
    "equal-tailed pointwise credible band of the deformation of gears like the tested "
    "one, without reading noise"
)


class Estimate(Interval):
    """A quantity, and whether data, a prior or the user determine it."""

    driven_by: Driver


class Estimates(Item):
    """Quantities of the gear without effects, and its peak deformation."""

    natural_frequency_Hz: Estimate = quantity("natural frequency", "Hz")
    damped_frequency_Hz: Estimate = quantity("frequency with damping", "Hz")
    damping_ratio: Estimate = quantity("damping ratio ζ")
    damping_N_s_per_mm: Estimate = quantity("damping c", "N·s/mm")
    mass_kg: Estimate = quantity("moved mass m", "kg")
    stiffness_N_per_mm: Estimate = quantity("stiffness k", "N/mm")
    peak_mm: Estimate = quantity("largest deformation", "mm")


class Response(Result):
    """The motion under a force, with credible bands.

    Attributes:
        motion: a row per time: force, ends and median of the pointwise band of the
            deformation as read from the unloaded gear, and whether it was tested.
        gears: what was calibrated.
    """

    template = "motion/response.md.j2"

    format: Literal["hdcal.response/1"] = "hdcal.response/1"
    gear: str
    calibration: Literal["moving", "at rest"]
    force: str
    temperature_C: float
    estimates: Estimates
    interval: float = INTERVAL
    interval_kind: str = _BAND
    tested_share: float = Field(ge=0.0, le=1.0)
    effects: tuple[str, ...]
    left_out: tuple[str, ...]
    draws: Count
    points: Count
    motion: pd.DataFrame = Field(exclude=True)
    gears: InstanceOf[CalibratedGears] = Field(exclude=True)

    @computed_field
    @property
    def remarks(self) -> tuple[Words, ...]:
        """Limits of the answer, in sentences."""
        return self.lines("remarks")

    @computed_field(alias="columns")
    @property
    def columns_of_motion(self) -> dict[str, list[float | bool]]:
        """The motion by column; response.csv."""
        return {str(name): each.tolist() for name, each in self.motion.items()}

    @property
    def facts(self) -> list[tuple[str, str]]:
        """The tested gear, as pairs of name and text."""
        posterior = self.gears.posterior
        return gear_rows(posterior.case, posterior.theory)

    def to_frame(self) -> pd.DataFrame:
        """Return the motion, a row per time."""
        return self.motion

    def make_charts(self) -> Mapping[str, Chart]:
        """Return deformation and force over time."""
        return {"response": response_chart(self.motion)}


def respond(
    models: Models,
    force: Force,
    *,
    amplitude: float = 80.0,
    frequency: float | Sequence[float] | None = None,
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
        force: `step`, `sine`, `chirp`, or a pair of times [s] and forces [N].
        amplitude: of a named shape, of either sign [N].
        frequency: of a sine, or first and last of a chirp [Hz].
        duration: of a named shape [s]; 0.5 by default.
        temperature: of the gear [°C]; by default the tested one nearest to the
            reference.
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
    gears, given = CalibratedGears(models), {"mass": mass, "damping": damping}
    require_force(gears.posterior.case, "respond")
    with Findings() as wrong:
        asked = force, amplitude, frequency, duration, points
        drive = wrong.attempt(make_drive, *asked)
        at = wrong.attempt(gears.temperature, temperature)
        wrong += implausible("draws", draws, "gears") + implausible("seed", seed)
        for name, value in given.items():
            wrong += implausible(name, value)
            if gears.moving and value is not None:
                words = "this calibration of the moving gear determines it"
                wrong.append(Finding(name, words, "Leave it out"))
    assert drive is not None and at is not None
    values = gears.draw(draws, seed)
    m, c, k = _coefficients(gears, values, at, given, seed)
    _check_reach(gears, drive, m, k)
    deformation, peak = integrate_all(gears, drive, at, values, m, c)
    # Quantiles are computed of a copy: part by part it takes little memory.
    parts = np.array_split(deformation, -(-points // _POINTS), axis=1)
    band = np.concatenate([np.quantile(p, TAILS, axis=0) for p in parts], axis=1)
    estimates = _estimates(gears, given, m, c, k, peak)
    return _response(gears, drive, at, band, estimates, len(m))


def _coefficients(gears: CalibratedGears, values, at: float, given, seed: int):
    """Return mass, damping and stiffness of each draw at a temperature [°C]."""
    case, count = gears.posterior.case, len(values["K"])
    k = values["stiffness"]
    k = k * (1.0 - values["alpha"] * (at - case.gear.reference_temperature))
    if gears.moving:
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


def _check_reach(gears: CalibratedGears, drive: Drive, m, k) -> None:
    """Refuse a wrong unit: a force that folds the gear, or a motion of hours."""
    with Findings() as wrong:
        static = float(drive.force.largest()) / np.median(k)
        if static >= gears.posterior.case.gear.reach:
            words = f"would deform the gear by {static:.3g} mm even at rest"
            wrong.append(Finding("force", words, "Give the force in N"))
        seconds = float(np.ptp(drive.times))
        swings = seconds * float(np.max(natural_frequency(m, k)))
        if swings > _MOST_SWINGS:
            words = f"{seconds:g} s are up to {swings:.2g} swings of the gear"
            remedy = f"Ask for at most {_MOST_SWINGS:g} swings, and give times in s"
            wrong.append(Finding("duration", words, remedy))


def _estimates(gears: CalibratedGears, given, m, c, k, peak) -> Estimates:
    """Return the quantities, and what determines them."""
    found = {n: one.driven_by for n, one in gears.posterior.diagnoses.items()}
    by: dict[str, Any] = {"k": found.get("K", "prior")}
    if gears.moving:
        names = {"m": "mass", "c": "damping_ratio"}
        by |= {n: found.get(name, "prior") for n, name in names.items()}
    else:
        names = {"m": "mass", "c": "damping"}
        by |= {
            n: "given" if given[v] is not None else "prior" for n, v in names.items()
        }
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


def _response(
    gears: CalibratedGears, drive: Drive, at: float, band, estimates, count: int
) -> Response:
    kept, left = acting(gears.effects)
    motion = pd.DataFrame(
        {
            "time_s": drive.times,
            "force_N": jax.vmap(drive.force)(drive.times),
            **dict(zip(_COLUMNS, band, strict=True)),
            "tested": gears.tested(at, band[0], band[2]),
        }
    )
    return Response(
        units=gears.posterior.case.units,
        gear=gears.posterior.case.gear.name,
        calibration="moving" if gears.moving else "at rest",
        force=drive.force.words(),
        temperature_C=at,
        estimates=estimates,
        tested_share=motion.tested.mean(),
        effects=tuple(effect.name for effect in kept),
        left_out=tuple(e.name for e in left if e.stage != "noise"),
        draws=count,
        points=len(motion),
        motion=motion,
        gears=gears,
    )
