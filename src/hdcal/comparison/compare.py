"""How much the stiffness of several results differs, and how surely."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Case
from hdcal.data.plausible import implausible
from hdcal.errors import Finding, Findings, InputError
from hdcal.notebook import Shown
from hdcal.prediction.engine.causes import Cause, causes_of
from hdcal.prediction.engine.models import Models
from hdcal.report.words import label

# Draws of each result that are compared with those of the others.
_DRAWS = 4000
# More results make a list that nobody reads.
MOST = 1000


@dataclass(frozen=True, repr=False)
class Comparison(Shown):
    """Results side by side; the first one is what the others are compared with.

    Attributes:
        names: of the results.
        stiffness: draws of each, shape (n, t) [N/mm as read].
        rows: readings that each rests on, shape (n,).
        tolerance: difference that matters [N/mm]; None where none was stated.
        notes: on what the comparison rests.
        seed: of the pairs of draws.
    """

    names: tuple[str, ...]
    stiffness: np.ndarray
    rows: np.ndarray
    tolerance: float | None
    notes: tuple[str, ...]
    seed: int

    @property
    def difference(self) -> np.ndarray:
        """Return draws of each one's stiffness less the first's, (n, t) [N/mm]."""
        return self.stiffness - self.stiffness[0]


def compare(
    results: Mapping[str, Models],
    *,
    tolerance: float | None = None,
    seed: int = 0,
) -> Comparison:
    """Compare the stiffness of finished results with that of the first.

    Each is of its own data, so that their posteriors are independent: a draw of one is
    paired with any draw of another.

    Args:
        results: what `calibrate` or `diagnose` returned, by a name.
        tolerance: difference of stiffness that matters [N/mm as read].
        seed: of the pairs.

    Raises:
        InputError: there are fewer than two, or they are not read alike.
        NotUsable: a result failed its checks.
    """
    with Findings() as wrong:
        wrong += implausible("tolerance", tolerance, "rate")
        wrong += implausible("seed", seed)
        named = {str(name) for name in results} if isinstance(results, Mapping) else ()
        if not 2 <= len(named) <= MOST or len(named) < len(results):
            words = f"a comparison takes 2 to {MOST} results by their names"
            remedy = "Give them as {'before': result, 'after': result}"
            wrong.append(Finding("results", words, remedy))
    causes = {str(name): _causes(str(name), one) for name, one in results.items()}
    cases = {name: models[0].posterior.case for name, models in causes.items()}
    _require_alike(cases)
    rng = np.random.default_rng(seed)
    return Comparison(
        names=tuple(causes),
        stiffness=np.stack([_draws(models, rng) for models in causes.values()]),
        rows=np.array([len(case.records.force) for case in cases.values()]),
        tolerance=tolerance,
        notes=tuple(_notes(causes, cases)),
        seed=seed,
    )


def _causes(name: str, result: Models) -> tuple[Cause, ...]:
    """Return the models of a result.

    Raises:
        InputError: it is none.
        NotUsable: it failed its checks.
    """
    try:
        return causes_of(result)
    except (TypeError, ValueError, AttributeError) as error:
        words = f"{name} is no calibrated model"
        remedy = "Give what calibrate or diagnose returned, itself"
        raise InputError([Finding("results", words, remedy)]) from error


def _draws(models: Sequence[Cause], rng: np.random.Generator) -> np.ndarray:
    """Return draws of the stiffness over all models, in any order [N/mm as read]."""
    parts = [
        np.resize(
            rng.permutation(model.values["stiffness"]),
            round(_DRAWS * model.probability) + 1,
        )
        for model in models
    ]
    return rng.permutation(np.concatenate(parts))[:_DRAWS]


def _require_alike(cases: Mapping[str, Case]) -> None:
    """Refuse results of which one was read along the radius, one the diameter.

    Raises:
        InputError: they were.
    """
    readings = {name: case.gear.reading for name, case in cases.items()}
    if len(set(readings.values())) > 1:
        told = ", ".join(f"{name} is {how}" for name, how in readings.items())
        words = f"are not read alike: {told}"
        remedy = "Read both along the radius, or both along the diameter"
        raise InputError([Finding("results", words, remedy)])


def _notes(
    causes: Mapping[str, Sequence[Cause]], cases: Mapping[str, Case]
) -> Iterator[str]:
    """Yield what else may make a difference, or is in none."""
    files: dict[str, str] = {}
    for name, case in cases.items():
        other = files.setdefault(case.data_sha256, name)
        if other != name:
            yield (
                f"{other} and {name} are of the same data: what parts them is the "
                "model, and their intervals are not independent."
            )
    effects = {
        name: " and ".join(
            sorted({label(e.name) for one in models for e in one.posterior.effects})
        )
        for name, models in causes.items()
    }
    if len(set(effects.values())) > 1:
        told = "; ".join(f"{name}: {what or 'none'}" for name, what in effects.items())
        yield f"Their models have other effects, which bear on the stiffness ({told})."
    warm = {name: case.gear.reference_temperature for name, case in cases.items()}
    if len(set(warm.values())) > 1:
        told = ", ".join(f"{name} {at:g} °C" for name, at in warm.items())
        yield f"Each stiffness is at its own reference temperature ({told})."
    if any(case.gear.gauge_priors for case in cases.values()):
        yield (
            "What certificates state of gauges is in the interval of each result by "
            "itself: where it is the same gauge, the difference is surer than it says."
        )
        return
    yield (
        "An error that all of them share, such as that of one load cell, is in no "
        "difference; one that only some have, such as that of another rig, is in no "
        "interval unless certificates state it."
    )
