"""A calibration as a result: estimates, findings and what to do about them."""

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Annotated, Literal, get_args

from pydantic import Field, InstanceOf

from hdcal.calibration.charts import calibration_chart, residual_chart
from hdcal.data.loading import movement_words
from hdcal.data.theory_names import SPRING, THEORY_WORDS, Theory
from hdcal.errors import Finding, InputError
from hdcal.inference.checks import INDEPENDENT, NOISY, PLAUSIBLE
from hdcal.inference.force_model.residuals import WILD, Residuals, residuals
from hdcal.inference.posterior import Posterior
from hdcal.physics.theory import THEORIES
from hdcal.prediction.bands.predict import default_bands
from hdcal.prediction.bands.result import Bands
from hdcal.report.charts.chart_spec import Chart
from hdcal.report.charts.draws_charts import prior_chart
from hdcal.report.item import Interval, Item, Words
from hdcal.report.posterior_result import (
    PARAMETER_NAMES,
    ParameterEstimate,
    PosteriorResult,
    posterior_fields,
)

_ALWAYS = ["K", "E0", "alpha", "force_offset", "deformation_offset", "sigma"]
_SIZED = [name for name in get_args(Theory) if name != SPRING]
# Covariates whose absence leaves a question open.
_WANTED = ("unloading", "specimen", "temperature")


class ResidualShape(Item):
    """A shape of the residuals that noise would rarely have, and its rms."""

    name: str
    p_value: Annotated[float, Field(ge=0.0, le=1.0)]
    size_N: Annotated[float, Field(ge=0.0)]
    words: Words


class Calibration(PosteriorResult):
    """What `hdcal calibrate` answers; summary.json.

    Residuals are their shapes, those of the noise last. Of several specimens each has
    its stiffness. Steps are names of what to do next, most urgent first.
    """

    template = "calibration/report.md.j2"

    format: Literal["hdcal.calibration/1"] = "hdcal.calibration/1"
    parameters: dict[str, ParameterEstimate] = Field(
        json_schema_extra={"required": [*_ALWAYS], "propertyNames": {**PARAMETER_NAMES}}
    )
    K_by_theory: dict[str, Interval | None] = Field(
        json_schema_extra={"required": [*_SIZED]}
    )
    residuals: tuple[ResidualShape, ...]
    effects: tuple[str, ...]
    with_gap: bool
    specimens: dict[str, Interval]
    steps: tuple[str, ...] = Field(exclude=True)
    left: InstanceOf[Residuals] = Field(exclude=True)

    @property
    def part_of_curve(self) -> str:
        """Working range over which a curve that is no line has its stiffness."""
        screening = self.posterior.case.screening
        part = None if screening is None else screening.straight
        if screening is None or part is None or part.whole or self.acting:
            return ""
        return screening.working_range

    @property
    def left_branch(self) -> str:
        """The movement whose readings were left out, in a word; empty for none."""
        case = self.posterior.case
        if case.excluded_sense == 0:
            return ""
        words = movement_words(case.from_unloaded, self.units.displacement)
        return words[case.excluded_sense]

    @property
    def known(self) -> frozenset[str]:
        """Covariates and features that the data have."""
        return frozenset(self.posterior.case.records.known)

    @property
    def acting(self) -> list[str]:
        """The effects that change the force."""
        return [e.name for e in self.posterior.effects if e.stage != "noise"]

    @property
    def shapes(self) -> set[str]:
        """Names of the shapes that the residuals have."""
        return {shape.name for shape in self.residuals}

    @property
    def reference_temperature(self) -> float | None:
        """That of the stiffness [°C]; None where no temperature was measured."""
        if "temperature" not in self.known:
            return None
        return self.posterior.case.gear.reference_temperature

    @property
    def theories(self) -> list[tuple[str, str, Interval | None]]:
        """Name, meaning and K of each theory; none of a spring."""
        if self.gear.theory == SPRING:
            return []
        return [(n, THEORY_WORDS.get(n, ""), K) for n, K in self.K_by_theory.items()]

    @cached_property
    def bands(self) -> Bands:
        """Force with its bands over the tested range and beyond; bands.csv."""
        return default_bands(self.posterior)

    def make_charts(self) -> Mapping[str, Chart]:
        """Return bands with readings, residuals and priors."""
        posterior, left = self.posterior, self.left
        return {
            "calibration": calibration_chart(posterior, self.bands, left),
            "residuals": residual_chart(left),
            "priors": prior_chart(posterior),
        }


def calibration_of(posterior: Posterior) -> Calibration:
    """Return a calibration as a result."""
    left, fields = residuals(posterior), posterior_fields(posterior)
    shapes = tuple(
        ResidualShape(name=s.name, p_value=s.p_value, size_N=s.size_N, words=s.words)
        for s in (*left.structure, *left.noise)
    )
    fields["warnings"] += tuple(shape.words for shape in shapes)
    return Calibration(
        **fields,
        K_by_theory=K_by_theory(posterior),
        residuals=shapes,
        effects=tuple(effect.name for effect in posterior.effects),
        with_gap=bool(posterior.settings["with_gap"]),
        specimens=_specimens(posterior),
        steps=tuple(dict.fromkeys(_steps(posterior, left))),
        left=left,
    )


def summarise(posterior: Posterior) -> dict:
    """Return a calibration as plain data: the content of summary.json."""
    if not isinstance(posterior, Posterior):
        words = f"a {type(posterior).__name__} is not a calibration"
        remedy = "Its numbers are in .to_frame() and .to_datatree()"
        raise InputError([Finding("posterior", words, remedy)])
    return calibration_of(posterior).to_dict()


def K_by_theory(posterior: Posterior) -> dict[str, Interval | None]:
    """Return K under every theory from the one posterior: K_a k_a = K_b k_b.

    None where there are no sizes: the stiffness of a spring is no factor of a theory.
    """
    if posterior.theory == SPRING:
        return dict.fromkeys(_SIZED)
    geometry, K = posterior.case.gear.geometry, posterior.draws["K"]
    unit = {name: float(THEORIES[name](geometry, 1.0)) for name in _SIZED}
    used = unit[posterior.theory]
    return {name: Interval.of(K * (used / other)) for name, other in unit.items()}


def _specimens(posterior: Posterior) -> dict[str, Interval]:
    """Return the stiffness of each of several specimens [N/mm as read]."""
    deviation = posterior.draws.get("specimen_deviation")
    if deviation is None:
        return {}
    stiffness = posterior.draws["stiffness"][:, None] * (1.0 + deviation)
    labels = posterior.case.specimen_labels
    return dict(zip(labels, map(Interval.of, stiffness.T), strict=True))


def _steps(posterior: Posterior, left: Residuals) -> Iterator[str]:
    """Yield names of what would make the answer better, most urgent first.

    The sentences are in the template.
    """
    if not posterior.usable:
        yield "failed"
        return
    known = posterior.case.records.known
    warned = {check.name for check in posterior.checks if check.outcome == "warning"}
    if PLAUSIBLE in warned:
        yield "implausible"
    if WILD in [shape.name for shape in left.noise]:
        yield WILD
    if "specimens" in known:
        yield "several specimens"
    if posterior.case.excluded_sense:
        yield "one branch"
    if INDEPENDENT in warned and "unloading" in known:
        yield "strong correlation"
    if posterior.settings["with_gap"]:
        yield "discrepancy"
    yield from (shape.name for shape in left.structure)
    yield from (shape.name for shape in left.noise if shape.name != WILD)
    if NOISY in warned and not left.structure:
        yield "much noise"
    wanted = _WANTED[1:] if posterior.case.excluded_sense else _WANTED
    yield from (f"no {name}" for name in wanted if name not in known)
