"""Fields of a result that follow from its posterior."""

import math
from collections.abc import Mapping
from dataclasses import asdict
from functools import cached_property
from typing import Annotated, Any

from pydantic import Field, InstanceOf

from hdcal.data.theory_names import SPRING, Theory
from hdcal.inference.checks import Check
from hdcal.inference.diagnostics import MIN_CONTRACTION, Convergence, Driver
from hdcal.inference.posterior import Posterior
from hdcal.inference.posterior_tree import group_of
from hdcal.physics.effect import parameters
from hdcal.report.item import INTERVAL, Count, Digest, Interval, Item, Words, quantity
from hdcal.report.provenance import data_rows, provenance_rows
from hdcal.report.result import Result
from hdcal.report.words import UNITS, capital, label, prior_words

_NAME = "[A-Za-z_][A-Za-z0-9_]*"
# Constraint of the schema on names of parameters.
PARAMETER_NAMES = {"pattern": f"^{_NAME}(\\.{_NAME})?$"}


class Quantity(Interval):
    """An interval with its unit."""

    unit: Words


class ParameterEstimate(Quantity):
    """A parameter with its diagnostics, NaN if the gear file fixes it.

    The contraction is the share of the prior's variance that the data removed.
    """

    rhat: float
    ess_bulk: float
    ess_tail: float
    contraction: float = Field(json_schema_extra={"maximum": 1})
    driven_by: Driver


class SamplerSettings(Item):
    """Settings and outcome of the sampler."""

    chains: Annotated[int, Field(ge=2)]
    warmup: Annotated[int, Field(ge=1)]
    draws: Annotated[int, Field(ge=1)]
    target_acceptance: float
    seconds: Annotated[float, Field(ge=0.0)]
    divergences: Count


class CalibratedGear(Item):
    """The gear and the theory of its model."""

    name: str
    material: str
    theory: Theory


class CalibratedData(Item):
    """The data, with the notes from reading them."""

    name: str
    rows: Annotated[int, Field(ge=1)]
    sha256: Digest
    notes: tuple[str, ...]


class PosteriorResult(Result):
    """A result with a sampled posterior; parameters that are fixed come last.

    The stiffness is at the reference temperature. Flat directions are sentences about
    what the data do not determine.
    """

    table = "quantities"

    warnings: tuple[Words, ...]
    parameters: dict[str, ParameterEstimate] = Field(
        json_schema_extra={"propertyNames": {**PARAMETER_NAMES}}
    )
    stiffness_N_per_mm: Interval = quantity("stiffness as read", "N/mm")
    flat_directions: tuple[Words, ...]
    interval: float = Field(default=INTERVAL, gt=0.0, lt=1.0)
    interval_kind: str = "equal-tailed credible interval"
    checks: tuple[Check, ...] = Field(min_length=1)
    sampling: SamplerSettings
    seed: Count
    versions: dict[str, str] = Field(json_schema_extra={"required": ["hdcal"]})
    gear: CalibratedGear
    data: CalibratedData
    posterior: InstanceOf[Posterior] = Field(exclude=True)

    @cached_property
    def quantities(self) -> Mapping[str, Quantity]:
        """The intervals of the result, such as the stiffness, then the parameters."""
        derived = {}
        for name in type(self).model_fields:
            if isinstance(interval := getattr(self, name), Interval):
                unit = self._extra(name, "unit")
                suffix = unit.replace("/", "_per_").replace("·", "_")
                shown = self.units.unit(unit) or "1"
                quantity = Quantity(**interval.model_dump(), unit=shown)
                derived[name.removesuffix(f"_{suffix}")] = quantity
        return {**derived, **self.parameters}

    @property
    def measured(self) -> Mapping[str, ParameterEstimate]:
        """The parameters without those that the theory defines."""
        defined = {"E0"} if self.gear.theory == SPRING else set()
        return {n: found for n, found in self.parameters.items() if n not in defined}

    @property
    def least_contraction(self) -> float:
        """Contraction from which data drive a parameter."""
        return MIN_CONTRACTION

    @property
    def data_facts(self) -> list[tuple[str, str]]:
        """The data, as pairs of name and text."""
        return data_rows(self.posterior.case)

    @property
    def provenance(self) -> list[tuple[str, str]]:
        """Model and sampling, as pairs of name and text."""
        return provenance_rows(self.posterior)

    @property
    def priors(self) -> list[tuple[str, str, str]]:
        """Label, prior and source of each parameter."""
        return [
            (
                label(name, self.gear.theory, self.units),
                prior_words(name, prior, self.units),
                prior.source or "the gear file",
            )
            for name, prior in self.posterior.priors.items()
            if name in self.measured
        ]


def posterior_fields(posterior: Posterior) -> dict[str, Any]:
    """Return the fields of a `PosteriorResult`."""
    case, settings, checks = posterior.case, posterior.settings, posterior.checks
    names = ("chains", "warmup", "draws", "target_acceptance", "seconds")
    sampling: dict[str, Any] = {name: settings[name] for name in names}
    diverging = group_of(posterior.tree, "sample_stats")["diverging"]
    return {
        "reasons": posterior.reasons,
        "units": case.units,
        "part": "part" if posterior.theory == SPRING else "gear",
        "warnings": tuple(capital(c.words) for c in checks if c.outcome == "warning"),
        "parameters": _estimates(posterior),
        "stiffness_N_per_mm": Interval.of(posterior.draws["stiffness"]),
        "flat_directions": tuple(c.words for c in checks if c.outcome == "note"),
        "checks": checks,
        "sampling": SamplerSettings(**sampling, divergences=int(diverging.sum())),
        "seed": settings["seed"],
        "versions": settings["versions"],
        "gear": CalibratedGear(
            name=case.gear.name, material=case.gear.material, theory=posterior.theory
        ),
        "data": CalibratedData(
            name=case.name,
            rows=len(case.records.force),
            sha256=case.data_sha256,
            notes=case.notes,
        ),
        "posterior": posterior,
    }


def unit_of(posterior: Posterior, name: str) -> tuple[str, float]:
    """Return the unit in which a parameter is shown, and its factor from code units."""
    if name == "K" and posterior.theory == SPRING:
        code, factor = "N/mm", 1.0
    elif name in UNITS:
        code, factor = UNITS[name]
    else:
        effect_name, field = name.split(".")
        effect = next(e for e in posterior.effects if e.name == effect_name)
        code, factor = parameters(effect)[field].unit, 1.0
    return posterior.case.units.unit(code), factor


def _estimates(posterior: Posterior) -> dict[str, ParameterEstimate]:
    """Return every parameter's estimate by name, fixed parameters last."""
    diagnoses, draws, nan = posterior.diagnoses, posterior.draws, math.nan
    fixed = [n for n in posterior.priors if n in draws and n not in diagnoses]
    by_file = Convergence(nan, nan, nan, contraction=0.0, driven_by="prior")
    estimates = {}
    for name in (*diagnoses, *fixed):
        unit, factor = unit_of(posterior, name)
        interval = Interval.of(draws[name] * factor)
        diagnosis = asdict(diagnoses.get(name, by_file))
        estimates[name] = ParameterEstimate(**dict(interval), unit=unit, **diagnosis)
    return estimates
