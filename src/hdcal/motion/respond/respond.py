"""How a calibrated gear moves under a force, with credible bands.

Where only the gear at rest was calibrated, data speak of the stiffness; mass and
damping are drawn from their priors, and the answer says so.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import jax
import numpy as np

from hdcal.data.plausible import implausible
from hdcal.errors import Finding, Findings, InputError, NotUsable
from hdcal.exported import jit
from hdcal.inference.members import MEMBERS
from hdcal.inference.posterior import Posterior
from hdcal.inference.problem import case_reading, without_scatter
from hdcal.motion.respond.answer import COLUMNS
from hdcal.motion.respond.document import remarks
from hdcal.motion.respond.drivers import drivers, tested_rows
from hdcal.motion.respond.integrate import integrate_all, unseen
from hdcal.motion.respond.request import Drive, Request, make_request
from hdcal.notebook import Shown
from hdcal.physics.dynamics import acting, natural_frequency
from hdcal.physics.forcing import Forcing
from hdcal.prediction.engine.conditions import temperature_findings, usual_temperature
from hdcal.prediction.engine.gear_forces import evenly, gear_values
from hdcal.prediction.engine.models import Models
from hdcal.prediction.engine.pooled import Pooled, pool
from hdcal.report.intervals import INTERVAL, credible_interval

# More take minutes, and a band that long past its start says nothing new.
_MOST_SWINGS = 20_000
# Times whose quantiles are taken at once: they are taken of a copy.
_TIMES = 10_000


@dataclass(frozen=True, repr=False)
class Response(Shown):
    """The motion under a force; one entry per time.

    Attributes:
        posterior: what the answer rests on, the most probable of several models.
        time_s: times.
        force_N: on the gear.
        deformation_lo_mm: lower end of the pointwise band of the deformation, as
            read, from the unloaded gear.
        deformation_median_mm: its median; no single gear need move like that.
        deformation_hi_mm: its upper end.
        tested: the whole band lies within the deformations and the temperature that
            were calibrated.
        estimates: mass_kg, damping_N_s_per_mm, damping_ratio, stiffness_N_per_mm,
            natural_frequency_Hz, damped_frequency_Hz, peak_mm (the largest size of
            the deformation): each with median, lo, hi and driven_by (data, prior or
            given).
        request: what was asked.
        temperature_C: of the gear.
        draws: number of gears integrated.
        effects: effects that were taken along.
        left_out: effects of the calibration that were not.
        remarks: what the reader must know, in sentences.
    """

    posterior: Posterior
    time_s: np.ndarray
    force_N: np.ndarray
    deformation_lo_mm: np.ndarray
    deformation_median_mm: np.ndarray
    deformation_hi_mm: np.ndarray
    tested: np.ndarray
    estimates: dict[str, dict]
    request: Request
    temperature_C: float
    draws: int
    effects: tuple[str, ...]
    left_out: tuple[str, ...]
    remarks: tuple[str, ...]

    def columns(self) -> dict[str, np.ndarray]:
        """Return the columns in the order of response.csv."""
        return {name: getattr(self, name) for name in COLUMNS}


def respond(
    models: Models,
    force: Drive,
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

    Motion begins at rest, from the unloaded gear.

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
    pooled = pool(models)
    with Findings() as wrong:
        request = wrong.attempt(
            make_request, force, amplitude, frequency, duration, points
        )
        wrong += _problems(pooled, temperature, mass, damping, draws, seed)
    assert request is not None
    return _move(pooled, request, temperature, mass, damping, draws, seed)


def _move(
    pooled: Pooled, request: Request, temperature, mass, damping, draws, seed
) -> Response:
    """Integrate every gear of the models, and say what its motion rests on."""
    posterior = pooled.causes[0].posterior
    usual = usual_temperature(pooled.case)
    at = usual if temperature is None else float(temperature)
    values, leftover = _what_moves(pooled, draws, seed)
    moved, ratio = unseen(posterior, values, mass, seed)
    kept, left = acting(without_scatter(pooled.effects))
    reading = case_reading(posterior.case)
    whole = {**values, "_mass": moved, "_ratio": ratio}
    _check_reach(posterior, request, values, moved)
    reach = posterior.case.gear.reach
    motion, facts, done, gone = integrate_all(
        kept, reading, whole, at, damping, request, reach, leftover
    )
    _check_motion(done, gone, reach)
    lo, middle, hi = _band(motion)
    estimates = {
        name: {**vars(credible_interval(facts[name])), "driven_by": driver}
        for name, driver in drivers(posterior, mass, damping).items()
    }
    tested = tested_rows(pooled, at, lo, hi)
    return Response(
        posterior,
        request.times,
        np.asarray(_forces(request.force, request.times)),
        lo,
        middle,
        hi,
        tested,
        estimates,
        request,
        at,
        len(done),
        tuple(effect.name for effect in kept),
        tuple(effect.name for effect in left),
        tuple(remarks(pooled, request.times, estimates, kept, left, tested)),
    )


@jit
def _forces(force: Forcing, times):
    return jax.vmap(force)(times)


def _what_moves(pooled: Pooled, draws: int, seed: int):
    """Return so many draws of one gear, and what a model of the force leaves of it.

    Members of what was tested are no part of a gear that moves, and may be many.
    """
    if pooled.moving:
        kept = evenly(len(pooled.index), draws)
        return {name: values[kept] for name, values in pooled.values.items()}, None
    values, untested = gear_values(pooled, seed, draws)
    own = {name: v for name, v in values.items() if name not in MEMBERS.values()}
    if "gap_weights" in values:
        own["gap_weights"] = values["gap_weights"]
    return own, (pooled.problem, untested)


def _check_motion(done: np.ndarray, gone: np.ndarray, reach: float) -> None:
    """Refuse what is no motion to its end.

    Raises:
        NotUsable: some motions are not.
    """
    if gone.any():
        raise NotUsable(
            f"{np.count_nonzero(gone)} of {len(gone)} gears give way under this force, "
            f"up to {reach:g} mm: no reading says that they resist where it takes "
            "them. Ask for a smaller amplitude, or measure that far, pulled as well as "
            "pushed, and calibrate again"
        )
    if not done.all():
        raise NotUsable(
            f"{np.count_nonzero(~done)} of {len(done)} motions could not be "
            "integrated: ask for a shorter duration"
        )


def _band(deformation: np.ndarray) -> np.ndarray:
    """Return the ends and the middle of the band at every time [mm]."""
    tail = (1.0 - INTERVAL) / 2.0
    parts = np.array_split(deformation, -(-deformation.shape[1] // _TIMES), axis=1)
    tails = [tail, 0.5, 1.0 - tail]
    return np.concatenate([np.quantile(p, tails, axis=0) for p in parts], axis=1)


def _problems(pooled: Pooled, temperature, mass, damping, draws, seed) -> list[Finding]:
    findings = []

    def find(name: str, problem: str, remedy: str) -> None:
        findings.append(Finding(name, problem, remedy))

    findings += implausible("mass", mass) + implausible("damping", damping)
    findings += implausible("draws", draws, "gears") + implausible("seed", seed)
    if pooled.moving:
        for name, value in (("mass", mass), ("damping", damping)):
            if value is not None:
                words = "this calibration of the moving gear knows it already"
                find(name, words, "Leave it out")
    if temperature is not None:
        gear, values = pooled.case.gear, pooled.values
        findings += temperature_findings(gear, values, np.array([temperature]))
    return findings


def _check_reach(posterior: Posterior, request: Request, values: dict, mass) -> None:
    """Refuse what is a slip of the unit: to fold the gear, or to swing for hours."""
    findings = []
    limit = posterior.case.gear.reach
    static = float(request.force.largest()) / np.median(values["stiffness"])
    if static >= limit:
        words = f"would deform the gear by {static:.3g} mm even at rest"
        findings.append(Finding("force", words, "Give the force in N"))
    seconds = float(request.times[-1] - request.times[0])
    swings = seconds * float(np.max(natural_frequency(mass, values["stiffness"])))
    if swings > _MOST_SWINGS:
        words = f"{seconds:g} s are up to {swings:.2g} swings of the gear"
        remedy = f"Ask for at most {_MOST_SWINGS:g} swings, and give times in s"
        findings.append(Finding("duration", words, remedy))
    if findings:
        raise InputError(findings)
