"""A diagnosis as a result: where the gap lies, which effects act, how far it closes."""

from collections.abc import Mapping
from typing import Literal

from pydantic import Field, InstanceOf

from hdcal.data.case import Case
from hdcal.diagnosis.charts import gap_chart, ladder_chart, which_chart
from hdcal.diagnosis.gap import GapByRow
from hdcal.diagnosis.next_run import NextRun
from hdcal.diagnosis.patterns import Seen
from hdcal.diagnosis.which import Cause, Which, either, share_words
from hdcal.inference.model_average import LeftOut, ModelAverage
from hdcal.inference.posterior import Posterior
from hdcal.report.charts.chart_spec import Chart
from hdcal.report.item import (
    INTERVAL,
    Count,
    Digest,
    EffectName,
    Interval,
    Item,
    Probability,
    Words,
    quantity,
)
from hdcal.report.result import Result


class Gap(Item):
    """Whether model and readings part, and by how much.

    The rms is that over the rows, where there is a gap; the correlation that of the
    noise of neighbouring readings.
    """

    probability: Probability
    rms_N: Interval | None = quantity("size of the gap", "N")
    noise_sd_N: float = quantity("noise of a reading", "N")
    share_of_full_scale: float | None
    correlation: float


class Rung(Item):
    """What a model leaves of the readings."""

    model: Words
    rms_N: float


class Nearest(Item):
    """Effects of one curve that alone come closest, and the share they explain."""

    effects: tuple[EffectName, ...]
    explains: float

    @property
    def words(self) -> str:
        """The effects in a sentence."""
        return either(self.effects)


class HowFar(Item):
    """How far the gap closes, from the formula alone down to the noise.

    `closed` is the share that the acting effects close on rows that they were not
    fitted to, None without any; `left_out` is what was left out of each fit. `nearest`
    are effects that do not act, but would explain half of the gap or more, where
    something outside the library explains more than any that acts.
    """

    ladder: tuple[Rung, ...]
    closed: Interval | None
    left_out: str
    nearest: Nearest | None

    @property
    def share(self) -> str:
        """The share of the gap that closes, in a sentence."""
        return share_words(self.closed) if self.closed else ""


class Refit(Item):
    """A hypothesis that was calibrated: a group of posterior.nc."""

    hypothesis: Words
    probability: Probability
    stiffness_N_per_mm: Interval = quantity("stiffness as read", "N/mm")


class Data(Item):
    """Which data they were."""

    name: str
    rows: Count
    rows_diagnosed: Count
    sha256: Digest
    notes: tuple[str, ...]


class Diagnosis(Result):
    """Result of `hdcal diagnose` on one case; verdict.json.

    The clearest patterns, the most informative runs for their effort and the most
    probable models come first; a quick diagnosis has no calibrated models. `left_out`
    are hypotheses without one. The stiffness is that over all models where it means the
    same in them.
    """

    template = "diagnosis/report.md.j2"
    table = "effects"

    format: Literal["hdcal.verdict/3"] = "hdcal.verdict/3"
    interval: float = INTERVAL
    gap: Gap
    seen: tuple[Seen, ...]
    which: Which
    how_far: HowFar
    next_test: tuple[NextRun, ...]
    refits: tuple[Refit, ...]
    left_out: LeftOut | None
    stiffness_N_per_mm: Interval | None = quantity("stiffness as read", "N/mm")
    coarse_step_N: float
    library: tuple[EffectName, ...]
    seed: Count
    versions: dict[str, str]
    data: Data
    case: InstanceOf[Case] = Field(exclude=True)
    rows: InstanceOf[GapByRow] = Field(exclude=True)
    posteriors: dict[str, tuple[float, InstanceOf[Posterior]]] = Field(exclude=True)

    @property
    def effects(self) -> tuple[Cause, ...]:
        """The classes of effects, and what is outside the library."""
        return (*self.which.causes, self.which.outside)

    @property
    def average(self) -> ModelAverage | None:
        """The calibrated models, for predictions; None of a quick diagnosis."""
        return ModelAverage(self.posteriors, self.left_out) if self.posteriors else None

    def make_charts(self) -> Mapping[str, Chart]:
        """Return where the gap lies, which effects cause it and how far it closes."""
        return {
            "where": gap_chart(self.case, self.rows),
            "which": which_chart(self.which),
            "how_far": ladder_chart(self.how_far, self.units),
        }
