"""Follow a gear reading by reading: stiffness, the next force, and a change alarm."""

from collections.abc import Callable
from math import isfinite
from typing import Any

import numpy as np

from hdcal.data.case import Gear
from hdcal.errors import Finding, InputError
from hdcal.inference.posterior import Posterior
from hdcal.tracking.change_alarm import ChangeAlarm
from hdcal.tracking.effect_tracking import build_particles
from hdcal.tracking.first_rows import Opening
from hdcal.tracking.linear_core import LinearCore, match
from hdcal.tracking.particles import LEAST_EFFECTIVE, ParticleCore
from hdcal.tracking.stream_prior import Beginning, of_gear, of_posterior

SCHEMA = "hdcal.track/1"
ALARM_ROWS = 10_000.0
_COLDEST, _NEAR_K, _NEAR_MM = -273.15, 1.0, 1e-9
# Beyond it a force [N] or a time [s] was not measured, and squares would overflow.
_MOST = 1e12


class Tracker:
    """Update the stiffness with every reading, and call when something changed.

    Without effects the update is exact: after any number of rows it is what a batch
    fit of all of them gives, under a normal prior of the linear coefficients and an
    inverse-gamma one of the noise variance. That prior has the moments of the
    posterior, or of the gear file's priors, that the tracker began with. With effects
    it is a set of weighted particles. Memory does not grow with the rows.

    Args:
        known: a calibration, or a gear whose priors are all there is.
        alarm_rows: mean number of readings between false alarms, 10 to 10⁹.
        forget: share of the past kept at each reading, 0.5 to 1 = all.
        reopen: after an alarm the stiffness may have moved by this share of itself
            (one sd), and the zero as with a new mounting; 0 = no alarm changes what
            is known.
        seed: of the draws that the beginning is matched to.

    Attributes:
        rows: how many rows were counted.
        alarms: how many times the alarm called.

    Raises:
        NotUsable: the calibration failed its checks.
        InputError: it holds what cannot be followed row by row, or an argument is out
            of range.
    """

    def __init__(
        self,
        known: Posterior | Gear,
        *,
        alarm_rows: float = ALARM_ROWS,
        forget: float = 1.0,
        reopen: float = 0.0,
        seed: int = 0,
    ):
        _check_settings(alarm_rows, forget, reopen)
        self._begin = _beginning(known, seed)
        self._core, self._features = _core(known, self._begin, forget)
        self._limits = _limits(known, self._begin)
        self._needs = _needs(known)
        self._alarm, self._alarm_rows = ChangeAlarm(alarm_rows), alarm_rows
        self._source = "a gear's priors" if isinstance(known, Gear) else "a calibration"
        self._since, self._run, self._reopen = 1, None, reopen
        self._first = self._core.coefficient(0)[2]
        self.rows = self.alarms = 0

    def update(
        self,
        deformation: float,
        force: float,
        *,
        temperature: float | None = None,
        time: float | None = None,
        run: str | None = None,
    ) -> dict:
        """Take one reading.

        Args:
            deformation: as read [mm].
            force: as read [N].
            temperature: of the specimen [°C]; by default the reference one.
            time: since the reset of the rig [s]; only some effects look at it.
            run: label of the mounting; another one than before opens the zero of the
                force again.

        Returns:
            The answer as plain data: a line of `hdcal track`.

        Raises:
            ValueError: a number is missing, not finite or none of this gear; nothing
                was learned from it.
        """
        reference = self._begin.reading.reference_temperature
        warmth = reference if temperature is None else temperature
        self._check(deformation, force, temperature, time)
        self._mount(run)
        features = self._features(deformation, warmth - reference, time or 0.0)
        middle, half, score = self._core.step(features, force)
        self.rows += 1
        share, alarm = self._alarm.step(score)
        found = {
            "schema": SCHEMA,
            "status": "ok",
            "row": self.rows,
            "stiffness_N_per_mm": self._stiffness(),
            "force_N": {
                "predicted": middle,
                "predictive_95": [middle - half, middle + half],
            },
            "innovation": score,
            "alarm": alarm,
            "alarm_score": share,
            "alarm_since_row": self._since,
            "tested": self._tested(deformation, warmth),
        }
        if alarm:
            self._restart()
        if isinstance(self._core, ParticleCore):
            found |= _degeneracy(self._core, found["stiffness_N_per_mm"])
        return found

    def _mount(self, run: str | None) -> None:
        """Open the zero of the force if the label of the mounting is another one."""
        if run is None or run == self._run:
            return
        if self._run is not None:
            self._core.widen(self._core.zero, self._begin.remounting)
        self._run = run

    def _restart(self) -> None:
        """Begin anew to look for a change, and open what may have changed."""
        self.alarms += 1
        self._since = self.rows + 1
        if self._reopen:
            moved = self._reopen * self._core.coefficient(0)[0]
            self._core.widen(0, moved**2)
            self._core.widen(self._core.zero, self._begin.remounting)

    def skip(self) -> int:
        """Count a row that was no reading, and return its number."""
        self.rows += 1
        return self.rows

    def describe(self) -> str:
        """Return in words where the tracker begins and what its alarm promises."""
        mean, _, half = self._core.coefficient(0)
        return (
            f"begins with {self._source}: stiffness {mean:.4g} N/mm, 95 % credible "
            f"interval {mean - half:.4g} … {mean + half:.4g}, on a mounting that was "
            f"not tested; one false alarm in {self._alarm_rows:g} readings"
        )

    def _stiffness(self) -> dict:
        mean, sd, half = self._core.coefficient(0)
        return {
            "mean": mean,
            "sd": sd if isfinite(sd) else None,
            "credible_95": [mean - half, mean + half],
            "narrowed": 1.0 - half / self._first if self._first else 0.0,
        }

    def _tested(self, deformation: float, temperature: float) -> bool | None:
        tested = self._limits["tested"]
        if tested is None:
            return None
        low, high, cold, warm = tested
        return low <= deformation <= high and cold <= temperature <= warm

    def _check(self, deformation, force, temperature, time) -> None:
        given = {"deformation": deformation, "force": force}
        given |= {"temperature": temperature, "time": time}
        for name, value in given.items():
            if value is None and name in self._needs:
                raise ValueError(f"the {name} is missing, and an effect needs it")
            if value is not None and not isfinite(value):
                raise ValueError(f"the {name} is not finite")
        if abs(deformation) >= self._limits["radius"]:
            raise ValueError(
                f"a deformation of {deformation:g} mm is none of this gear"
            )
        if abs(force) > _MOST or abs(time or 0.0) > _MOST:
            raise ValueError("the force or the time is no measured one")
        if temperature is not None and temperature < _COLDEST:
            raise ValueError("the temperature is below absolute zero")
        if temperature is not None and temperature > self._limits["hottest"]:
            raise ValueError(f"{temperature:g} °C leaves nothing of the stiffness")


def _degeneracy(core: ParticleCore, stiffness: dict) -> dict:
    effective = core.effective
    degenerate = effective < LEAST_EFFECTIVE
    if degenerate:
        # A few draws are left: their spread is no posterior's.
        stiffness |= {"sd": None, "credible_95": None, "narrowed": None}
    return {"effective_particles": effective, "degenerate": degenerate}


def _check_settings(alarm_rows: float, forget: float, reopen: float) -> None:
    findings = []
    if not 10.0 <= alarm_rows <= 1e9:
        words = f"{alarm_rows:g} is out of range"
        findings.append(Finding("--alarm-rows", words, "Use 10 to 1e9"))
    if not 0.5 <= forget <= 1.0:
        words = f"{forget:g} is out of range"
        remedy = "Use 0.5 to 1; 0.999 keeps about the last thousand readings"
        findings.append(Finding("--forget", words, remedy))
    if not 0.0 <= reopen <= 1.0:
        words = f"{reopen:g} is out of range"
        remedy = "Use a share of the stiffness, such as 0.1"
        findings.append(Finding("--reopen", words, remedy))
    if findings:
        raise InputError(findings)


def _beginning(known: Posterior | Gear, seed: int) -> Beginning:
    if isinstance(known, Gear):
        return of_gear(known, seed)
    known.require_usable()
    if known.problem.discrepancy is not None:
        words = "holds a leftover discrepancy, which cannot be followed"
        remedy = "Calibrate again without --with-gap"
        raise InputError([Finding("RUN", words, remedy)])
    return of_posterior(known, seed)


def _core(
    known: Posterior | Gear, begin: Beginning, forget: float
) -> tuple[LinearCore | Opening | ParticleCore, Callable[..., Any]]:
    """Return the core, and what makes of a row the features that it takes."""
    if not isinstance(known, Gear) and known.problem.effects:
        return build_particles(known, begin, forget)
    if isinstance(known, Gear):
        core: LinearCore | Opening = Opening(
            begin.coefficients(), begin.variance, forget
        )
    else:
        core = LinearCore(match(begin.coefficients(), begin.variance), forget)

    def columns(deformation: float, rise: float, time: float) -> list[float]:
        # Those of physics.chain.linear_columns.
        return [deformation, deformation * rise, 1.0, rise]

    return core, columns


def _limits(known: Posterior | Gear, begin: Beginning) -> dict:
    gear = known if isinstance(known, Gear) else known.case.gear
    # Where the linear law E(T) has lost half of the modulus; never hotter than that.
    alpha = max(float(np.median(begin.base.alpha)), 1e-5)
    found = {
        "radius": float(gear.geometry.radius) / begin.reading.radial_per_read,
        "hottest": gear.reference_temperature + 0.5 / alpha,
        "tested": None,
    }
    if isinstance(known, Gear):
        return found
    records = known.case.records
    low, high = np.min(records.deformation), np.max(records.deformation)
    cold, warm = np.min(records.temperature), np.max(records.temperature)
    ends = (low - _NEAR_MM, high + _NEAR_MM, cold - _NEAR_K, warm + _NEAR_K)
    return {**found, "tested": tuple(map(float, ends))}


def _needs(known: Posterior | Gear) -> frozenset[str]:
    effects = () if isinstance(known, Gear) else known.problem.effects
    return frozenset().union(*(effect.needs for effect in effects))
