"""The part of a JSON answer that tells of a sampled posterior."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from hdcal.data.theory_names import Theory
from hdcal.inference.checks import Check
from hdcal.inference.posterior import Posterior
from hdcal.inference.posterior_tree import group_of
from hdcal.report.answer import Answer, Count, Digest, Promise, Sentences
from hdcal.report.intervals import INTERVAL, Interval, credible_interval
from hdcal.report.parameters import ParameterEstimate, parameter_estimates
from hdcal.report.words import capital

_OneOrMore = Annotated[int, Promise(minimum=1)]
_NAME = "[A-Za-z_][A-Za-z0-9_]*"
# What a generated schema says of the names of parameters.
PARAMETER_NAMES = {"pattern": f"^{_NAME}(\\.{_NAME})?$"}


@dataclass(frozen=True)
class Sampling:
    """How the draws were come by."""

    chains: Annotated[int, Promise(minimum=2)]
    warmup: _OneOrMore
    draws: _OneOrMore
    target_acceptance: float
    seconds: Annotated[float, Promise(minimum=0)]
    divergences: Count


@dataclass(frozen=True)
class CalibratedGear:
    """Which gear it was, and by which formula it was modelled."""

    name: str
    material: str
    theory: Theory


@dataclass(frozen=True)
class CalibratedData:
    """Which data it was; notes are from reading them."""

    name: str
    rows: _OneOrMore
    sha256: Digest
    notes: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class PosteriorAnswer(Answer):
    """What every calibration answers.

    Attributes:
        warnings: sentences to be aware of.
        parameters: by name, those that were fixed last.
        stiffness_N_per_mm: at the reference temperature, per mm as read.
        flat_directions: what the data cannot see or tell apart, in sentences.
        interval: probability that every interval holds.
        interval_kind: what kind of interval it is.
        checks: all of them.
        sampling: how the draws were come by.
        seed: of the draws.
        versions: of the packages that made them.
        gear: that was calibrated.
        data: that it was calibrated with.
    """

    warnings: Sentences
    parameters: dict[str, ParameterEstimate]
    stiffness_N_per_mm: Interval
    flat_directions: Sentences
    interval: Annotated[float, Promise(exclusiveMinimum=0, exclusiveMaximum=1)]
    interval_kind: str
    checks: Annotated[tuple[Check, ...], Promise(minItems=1)]
    sampling: Sampling
    seed: Count
    versions: Annotated[dict[str, str], Promise(required=["hdcal"])]
    gear: CalibratedGear
    data: CalibratedData


def posterior_entries(
    posterior: Posterior, headline: str, steps: Sequence[str]
) -> dict[str, Any]:
    """Return what a `PosteriorAnswer` holds.

    Args:
        posterior: that was sampled.
        headline: of a calibration that passed its checks.
        steps: what to do next, most urgent first.
    """
    case, settings = posterior.case, posterior.settings
    return {
        "status": "ok" if posterior.usable else "failed",
        "reasons": posterior.reasons,
        "headline": headline if posterior.usable else _failed(posterior),
        "next_step": steps[0] if steps else None,
        "warnings": _warnings(posterior),
        "parameters": parameter_estimates(posterior),
        "stiffness_N_per_mm": credible_interval(posterior.draws["stiffness"]),
        "flat_directions": tuple(
            check.words for check in posterior.checks if check.outcome == "note"
        ),
        "interval": INTERVAL,
        "interval_kind": "equal-tailed credible interval",
        "checks": posterior.checks,
        "sampling": _sampling(posterior),
        "seed": settings["seed"],
        "versions": settings["versions"],
        "gear": CalibratedGear(case.gear.name, case.gear.material, posterior.theory),
        "data": CalibratedData(
            case.name, len(case.records.force), case.data_sha256, case.notes
        ),
    }


def _failed(posterior: Posterior) -> str:
    listed = "; ".join(posterior.reasons)
    return f"This calibration failed its checks and must not be used: {listed}."


def _warnings(posterior: Posterior) -> tuple[str, ...]:
    """Return the warnings of the checks as sentences."""
    return tuple(
        capital(check.words) for check in posterior.checks if check.outcome == "warning"
    )


def _sampling(posterior: Posterior) -> Sampling:
    diverging = group_of(posterior.tree, "sample_stats")["diverging"]
    names = ("chains", "warmup", "draws", "target_acceptance", "seconds")
    settings: dict[str, Any] = {name: posterior.settings[name] for name in names}
    return Sampling(**settings, divergences=int(diverging.sum()))
