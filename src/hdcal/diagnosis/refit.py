"""Calibration of the probable hypotheses by NUTS, each with its probability.

Those of 5 % and more are calibrated, whatever the verdict. If the others have more than
2 % together, the likeliest with a discrepancy stands for them, as it bends
wherever the data let it; else the model that knows the stiffness least.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Set
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hdcal.data.case import Case
from hdcal.evidence.row_features import thin_rows
from hdcal.evidence.table import OUTSIDE, Names
from hdcal.inference.model_average import NONE, UNKNOWN, LeftOut
from hdcal.inference.posterior import Posterior
from hdcal.physics.effect import Effect

if TYPE_CHECKING:
    from hdcal.inference.sample import Progress

# Least probability of a hypothesis that is calibrated; more than the second is not left
# without a model with a discrepancy.
_LEAST_SHARE, _MOST_LEFT_OUT = 0.05, 0.02
# Rows from which on a model with a loop and a discrepancy takes minutes to calibrate,
# and iterations by which a sampler in whitened coordinates has found its step.
_MOST_ROWS, _WARMUP = 1_000, 500


@dataclass(frozen=True)
class Refits:
    """Calibrated hypotheses that may be used, with probabilities that sum to 1.

    `none` is the plain model, `unknown` that with a discrepancy. `left_out` is the
    probability without a model among these; `failures` say why others cannot be used.
    """

    posteriors: Mapping[str, tuple[float, Posterior]]
    left_out: LeftOut | None
    failures: tuple[str, ...]


def rows_to_calibrate(case: Case) -> Case:
    """Return the case with about 1,000 rows at most, the turns among them."""
    few = thin_rows(case, _MOST_ROWS, turns=True)
    if few is case:
        return case
    left, rows = len(few.records.force), len(case.records.force)
    words = f"{left} of {rows} rows were used for calibration"
    return replace(few, notes=(*few.notes, words))


def refit(
    case: Case,
    hypotheses: Mapping[Names, float],
    library: dict[str, type[Effect]],
    seed: int,
    progress: "Progress | None",
) -> Refits:
    """Calibrate every hypothesis that is probable enough; probabilities sum to 1.

    An effect can be probable without the readings that its calibration needs, as one of
    the speed where a loop was read at one speed. Another model carries its probability.
    A discrepancy stands for effects beside it that depend on the deformation alone:
    both could describe the same curve, and a sampler would hardly move.
    Progress is that of one calibration after the other.
    """
    # Importing what samples takes longer than all the rest of a quick diagnosis.
    from hdcal.calibration.calibrate import calibrate

    lacking = {n for n, each in library.items() if each.needs - case.records.known}
    # Effects that are curves of the deformation alone, as a discrepancy is.
    curves = {n for n, e in library.items() if not e.needs and e.stage != "noise"}
    probabilities: dict[str, float] = defaultdict(float)
    for key, chance in hypotheses.items():
        if lacking.isdisjoint(key):
            kept = {*key} - curves if OUTSIDE in key else key
            probabilities[_name(kept)] += chance

    def calibrated(name: str) -> Posterior:
        parts = _parts(name)
        return calibrate(
            case,
            effects=tuple(sorted(parts - {UNKNOWN})),
            with_gap=UNKNOWN in parts,
            adapt_noise=False,
            warmup=_WARMUP,
            seed=seed,
            registry=library,
            progress=progress,
        )

    return weighed(probabilities, calibrated, curves)


def weighed(
    probabilities: Mapping[str, float],
    calibrated: Callable[[str], Posterior],
    curves: Set[str] = frozenset(),
) -> Refits:
    """Return the hypotheses that are kept; probabilities of all sum to 1.

    A discrepancy stands for the effects among `curves`.
    """
    fits = {name: calibrated(name) for name in _probable(probabilities)}
    usable = {name: fit for name, fit in fits.items() if fit.usable}
    missing = max(1.0 - sum(probabilities[name] for name in usable), 0.0)
    carrier = ""
    if missing > _MOST_LEFT_OUT:
        likeliest = max(probabilities, key=probabilities.__getitem__)
        beside = _name({*_parts(likeliest), OUTSIDE} - curves)
        for name in dict.fromkeys((beside, UNKNOWN)):
            fits[name] = fit = fits.get(name) or calibrated(name)
            if fit.usable:
                usable[name], carrier = fit, name
                break
    failed = {name: fit for name, fit in fits.items() if name not in usable}
    failures = tuple(
        f"the calibration with {name} failed its checks: " + "; ".join(fit.reasons)
        for name, fit in failed.items()
    )
    if not usable:
        return Refits({}, None, failures)
    missing = max(1.0 - sum(probabilities.get(name, 0.0) for name in usable), 0.0)
    width = {n: float(np.std(fit.draws["stiffness"])) for n, fit in usable.items()}
    carrier = carrier or max(width, key=width.__getitem__)
    models = {
        name: (probabilities.get(name, 0.0) + missing * (name == carrier), fit)
        for name, fit in usable.items()
    }
    return Refits(models, LeftOut(missing, carrier), failures)


def _probable(probabilities: Mapping[str, float]) -> list[str]:
    """Return the hypotheses that are calibrated whatever the verdict."""
    ranked = sorted(probabilities, key=lambda name: -probabilities[name])
    return [n for n in ranked if probabilities[n] >= _LEAST_SHARE] or ranked[:1]


def _name(components: Iterable[str]) -> str:
    """Return the name of a hypothesis: its effects in order, then `unknown`."""
    effects = sorted({*components} - {OUTSIDE, UNKNOWN})
    outside = {*components} & {OUTSIDE, UNKNOWN}
    return "+".join([*effects, *([UNKNOWN] if outside else [])]) or NONE


def _parts(name: str) -> frozenset[str]:
    """Return the effects of a hypothesis, and `unknown` where it has a discrepancy."""
    return frozenset(name.split("+")) - {NONE}
