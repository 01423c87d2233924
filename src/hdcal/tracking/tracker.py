"""Follow a gear reading by reading: stiffness, the next force, and a change alarm."""

from math import inf, isfinite, sqrt

import numpy as np

from hdcal.data.case import Gear
from hdcal.data.plausible import implausible
from hdcal.errors import Findings
from hdcal.prediction.engine.models import Models
from hdcal.prediction.engine.untested_reading import UNKNOWNS
from hdcal.tracking.beginning import begin_core, begin_prior, usual_design
from hdcal.tracking.change_alarm import ChangeAlarm, threshold_for
from hdcal.tracking.coarse_rounding import CoarseRounding
from hdcal.tracking.first_rows import FirstRows
from hdcal.tracking.followed_causes import followed_causes
from hdcal.tracking.forgetting_alarm import forgetting_threshold, settling_rows
from hdcal.tracking.full_scale import AssumedFullScale
from hdcal.tracking.linear_core import STIFFNESS, ZERO, LinearCore
from hdcal.tracking.particles import LEAST_EFFECTIVE, Particles
from hdcal.tracking.reading_limits import reading_limits
from hdcal.tracking.serial_correlation import SerialCorrelation
from hdcal.tracking.unequal_rows import RowTerms, UnequalRows

SCHEMA = "hdcal.track/1"
ALARM_ROWS = 10_000.0
# With forgetting the threshold is taken anew when the correlation has changed by this.
_ANOTHER_CORRELATION = 0.1
# Errors that repeat with the force, by more than this share, are no correlated noise.
_MOST_REPEATED = 0.1


class Tracker:
    """Update the stiffness with every reading, and call when something changed.

    Without effects the update is exact: after any number of rows it is what a batch
    fit of all of them gives, under a normal prior of the linear coefficients and an
    inverse-gamma one of the noise variance, with the moments of what the tracker began
    with; of several causes each has its own, weighted. With effects it is a set of
    weighted particles. Memory does not grow with the rows.

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
        known: Models | Gear,
        *,
        alarm_rows: float = ALARM_ROWS,
        forget: float = 1.0,
        reopen: float = 0.0,
        seed: int = 0,
    ):
        with Findings() as wrong:
            wrong += implausible("alarm_rows", alarm_rows)
            wrong += implausible("forget", forget) + implausible("reopen", reopen)
            wrong += implausible("seed", seed)
        self._causes, self._unequal = [], None
        if isinstance(known, Gear):
            begin, prior = known, begin_prior(known, seed)
        else:
            begin, self._causes = followed_causes(known, forget)
            prior = begin_prior(begin, seed)
            self._unequal = UnequalRows(begin, prior)
        self._unknowns, self._full_scale = False, AssumedFullScale(begin)
        self._core, self._columns = begin_core(begin, prior, forget, self._unequal)
        self._slow, self._noise = self._core.slower(), SerialCorrelation()
        self._rounding = CoarseRounding(prior.step, forget)
        self._limits = reading_limits(begin, prior)
        self._reference = prior.reading.reference_temperature
        self._remounting = prior.remounting
        self._alarm_rows = alarm_rows
        self._alarm = ChangeAlarm(threshold_for(alarm_rows))
        self._design = usual_design(begin, prior, self._unequal)
        self._source = "a gear's priors" if isinstance(known, Gear) else "a calibration"
        self._since, self._run = 1, None
        self._forget, self._reopen = forget, reopen
        self._threshold_for = inf
        self._first = self._core.coefficient(STIFFNESS)[2]
        self.rows = self.alarms = self._readings = 0

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
            run: label of the mounting; another one widens the zero of the force.

        Returns:
            The answer as plain data: a line of `hdcal track`.

        Raises:
            ValueError: a number is missing or none of this gear; nothing was learned.
        """
        warmth = self._reference if temperature is None else temperature
        self._limits.check(deformation, force, temperature, time)
        self._mount(run)
        tested = self._limits.were_tested(deformation, warmth)
        self._noise.follow(time)
        columns, terms = self._row(deformation, warmth, time or 0.0, tested=tested)
        rho, weight = self._noise.value, self._noise.weight
        middle, half, score = self._step(columns, force, terms)
        share, alarm = self._alarm.step(weight * score)
        found = {
            "schema": SCHEMA,
            "status": "ok",
            "row": self.rows,
            "stiffness_N_per_mm": self._stiffness(),
            "force_N": _force(middle, half),
            "innovation": score,
            "alarm": alarm,
            "alarm_score": share,
            "alarm_since_row": self._since,
            "false_alarm_rows": self._alarm_rows,
            "correlation": rho,
            "tested": tested,
        }
        if alarm:
            self._restart()
        return found | _degeneracy(self._core, found["stiffness_N_per_mm"])

    def _row(
        self, deformation: float, warmth: float, time: float, *, tested: bool | None
    ) -> tuple[np.ndarray, RowTerms]:
        """Count a row; return its columns, and what it has beside the model."""
        self.rows, self._readings = self.rows + 1, self._readings + 1
        terms = RowTerms()
        if self._unequal is not None:
            terms = self._unequal.at(deformation, warmth, tested=tested)
        columns = self._columns(deformation, warmth - self._reference, time)
        return self._with_unknowns(columns, terms), terms

    def _with_unknowns(self, columns: np.ndarray, terms: RowTerms) -> np.ndarray:
        """Return the columns beside those of what untested conditions add.

        The unknowns come with the first untested row: until then none says anything.
        """
        if not self._unknowns:
            if terms.columns is None:
                return columns
            self._unknowns = True
            self._design = np.pad(self._design, ((0, 0), (0, UNKNOWNS)))
            for core in {self._core, self._slow}:
                core.add_unknowns(UNKNOWNS)
            self._noise.restart()
        own = np.zeros(UNKNOWNS) if terms.columns is None else terms.columns
        own = np.broadcast_to(own, (*columns.shape[:-1], UNKNOWNS))
        return np.concatenate([columns, own], axis=-1)

    def _step(
        self, columns, force: float, terms: RowTerms
    ) -> tuple[float, float, float]:
        """Predict a row from the rows before it, then learn from it.

        Returns:
            Middle [N], half-width of the 95 % interval [N], normal score.
        """
        self._full_scale.see(force)
        shift, weight = terms.shift, terms.weight
        columns, force = columns * weight, (force - shift) * weight
        expected = self._slow.expect(columns)
        repeated = self._rounding.share(self._slow.variance() * terms.noise)
        told = self._rounding.weight(expected / weight + shift, repeated)
        row = self._noise.whiten(columns, force)
        middle, half, score = self._core.step(row.columns, row.force, told)
        if self._slow is not self._core:
            self._slow.step(row.columns, row.force, told)
        if repeated < _MOST_REPEATED:
            self._noise.learn((force - expected) / half)
        if isinstance(self._core, FirstRows) and self._core.complete:
            self._core = self._core.merged(self._forget)
            self._slow = self._core.slower()
        self._set_threshold()
        middle, half = row.carried + row.scale * middle, row.scale * half
        return middle / weight + shift, half / weight, score

    def _set_threshold(self) -> None:
        """Take the threshold of a core that forgets, once it has settled."""
        if self._forget == 1.0 or self._readings <= settling_rows(self._forget):
            return
        rho = self._noise.value
        moved = abs(rho - self._threshold_for) > _ANOTHER_CORRELATION
        if moved and isinstance(self._core, LinearCore):
            self._threshold_for = rho
            self._alarm.threshold = forgetting_threshold(
                self._core.prior, self._forget, self._design, self._alarm_rows, rho
            )

    def skip(self) -> int:
        """Count a row that was no reading, and return its number."""
        self.rows += 1
        self._noise.restart()
        return self.rows

    def describe(self) -> str:
        """Return in words where the tracker begins and what its alarm promises."""
        mean, _, half = self._core.coefficient(STIFFNESS)
        words = [
            f"begins with {self._source}: stiffness {mean:.4g} N/mm, 95 % credible "
            f"interval {mean - half:.4g} … {mean + half:.4g}, on a mounting that was "
            f"not tested; one false alarm in {self._alarm_rows:g} readings"
        ]
        return "\n".join(words + self._full_scale.at_start() + self._causes)

    def summary(self) -> str:
        """Say how many alarms there were, and how many are due by chance."""
        due = self._readings / self._alarm_rows
        words = (
            f"{self.rows} rows, {self.alarms} alarms; without a change {due:.2g} false "
            f"ones are due in {self._readings} readings"
        )
        if rho := self._noise.value:
            words += (
                f"; readings are correlated with the one before ({rho:.2f}), which is "
                "taken into account"
            )
        # Three sds of a Poisson number above what is due are no chance.
        many = self.alarms > due + 3.0 * sqrt(due)
        if many and not self._reopen and self._forget == 1.0:
            words += (
                "; a change is followed slowly, and may look like correlation: with "
                "`reopen` above 0 a changed gear is learned anew"
            )
        return words + self._full_scale.at_end()

    def _mount(self, run: str | None) -> None:
        """Widen the zero of the force if the label of the mounting is another one."""
        if run is None or run == self._run:
            return
        if self._run is not None:
            self._widen(ZERO, self._remounting)
            self._noise.restart()
            self._rounding.restart()
        self._run = run

    def _widen(self, index: int, variance: float) -> None:
        self._core.widen(index, variance)
        if self._slow is not self._core:
            self._slow.widen(index, variance)

    def _restart(self) -> None:
        """Begin anew to look for a change; widen what may have changed, if wanted."""
        self.alarms += 1
        self._since = self.rows + 1
        if self._reopen:
            moved = self._reopen * self._core.coefficient(STIFFNESS)[0]
            self._widen(STIFFNESS, moved**2)
            self._widen(ZERO, self._remounting)
            self._rounding.restart()

    def _stiffness(self) -> dict:
        mean, sd, half = self._core.coefficient(STIFFNESS)
        return {
            "mean": mean,
            "sd": sd if isfinite(sd) else None,
            "credible_95": [mean - half, mean + half],
            "narrowed": 1.0 - half / self._first if self._first else 0.0,
        }


def _force(middle: float, half: float) -> dict:
    return {"predicted": middle, "predictive_95": [middle - half, middle + half]}


def _degeneracy(core, stiffness: dict) -> dict:
    if not isinstance(core, Particles):
        return {}
    effective = core.effective
    degenerate = effective < LEAST_EFFECTIVE
    if degenerate:
        # A few draws are left: their spread is no posterior's.
        stiffness |= {"sd": None, "credible_95": None, "narrowed": None}
    return {"effective_particles": effective, "degenerate": degenerate}
